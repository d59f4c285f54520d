#pragma once

#include <string>
#include <string_view>
#include <vector>

/// Which vector instructions the kernels use. Every kernel is compiled for several of them
/// ("paths"), and the best that this processor has is chosen at run time.
namespace upswing {

/// The paths that this processor can take, best first: such as "avx512", "avx2", "portable".
std::vector<std::string> SimdPaths();

/// The path in use: the first of SimdPaths, unless UseSimdPath chose another.
std::string SimdPath();

/// Switches to another path, for tests and benchmarks; no kernel may be running. Throws
/// BadInput if this processor does not have it.
void UseSimdPath(std::string_view path);

}  // namespace upswing
