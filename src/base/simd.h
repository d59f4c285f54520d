#pragma once

#include <string>
#include <string_view>
#include <vector>

/// Choice of the vector instructions that the kernels use. Every kernel is compiled for several
/// instruction sets ("paths"). The program chooses the best path of the processor at run time.
namespace upswing {

/// The paths that this processor supports, best first: such as "avx512", "avx2", "portable".
std::vector<std::string> SimdPaths();

/// The path in use: the first of SimdPaths, unless UseSimdPath chose another.
std::string SimdPath();

/// Switches to another path, for tests and benchmarks. No kernel may be running. Throws BadInput if
/// this processor does not support the path.
void UseSimdPath(std::string_view path);

}  // namespace upswing
