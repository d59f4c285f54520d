#pragma once

#include <cstddef>
#include <string>

/// A look at MJCF before MuJoCo sees it. MuJoCo compiles before anybody can judge, and MJCF can ask
/// for any file and for any amount of memory or time.
namespace upswing {

/// A model like ours takes less than a thousand.
inline constexpr size_t kMostMjcfBytes = 65536;

/// Throws BadInput, with `where` (a file's name) and the line, unless `mjcf` is well-formed XML in
/// UTF-8 of at most kMostMjcfBytes, made of nothing but the elements and attributes that describe a
/// double pendulum: links, joints, a motor, options of the simulation, and what costs nothing to
/// carry along (lights, cameras, sites, sensors of joints, key frames). Each number is finite and
/// within a range. Nothing that is looked up in files, repeated, sized by a number, or that changes
/// the motion behind the plant's parameters (wind, gravity compensation, limits of forces).
/// Whether it is a double pendulum is for LoadModel to say.
void CheckMjcf(const std::string& mjcf, const std::string& where);

}  // namespace upswing
