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
/// attributes of bodies, joints, geoms, a motor and options of the simulation, each number finite
/// and within 1e6, and anything that CompileModel leaves out.
///
/// Refused are attributes that read files, repeat elements or set a size, delays, and sleep or
/// disabled groups, which LoadModel cannot see. MuJoCo then checks the values, and LoadModel checks
/// that the model moves as a double pendulum.
void CheckMjcf(const std::string& mjcf, const std::string& where);

}  // namespace upswing
