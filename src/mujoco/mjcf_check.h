#pragma once

#include <cstddef>
#include <string>

/// Checks MJCF before MuJoCo compiles it, because untrusted MJCF could make the compiler read any
/// file or use any amount of memory or time.
namespace upswing {

/// Largest size of an MJCF; the built-in model has less than a thousand bytes.
inline constexpr size_t kMostMjcfBytes = 65536;

/// Throws BadInput, with `where` (a file's name) and the line, unless `mjcf` is a safe model. It
/// must be well-formed XML in UTF-8 of at most kMostMjcfBytes. It may contain only the elements and
/// attributes that describe a double pendulum: links, joints, a motor, options of the simulation,
/// and harmless extras (lights, cameras, sites, sensors of joints, key frames). Each number must be
/// finite and within 1e6.
///
/// Refused are attributes that read files, repeat elements or set a size. Also refused are
/// attributes that change the motion in ways that the plant's parameters do not describe (wind,
/// gravity compensation, limits of forces). MuJoCo then checks the values, and LoadModel checks
/// that the model is a double pendulum.
void CheckMjcf(const std::string& mjcf, const std::string& where);

}  // namespace upswing
