#pragma once

#include <string>
#include <string_view>
#include <vector>

/// Choice of the vector instructions that the kernels use. Every kernel is compiled for several
/// instruction sets ("paths"). The program chooses the best path of the processor at run time.
namespace upswing {

/// The paths that this processor supports, best first: such as "avx512", "avx2", "portable". All
/// paths with fused multiply-adds give the same bits. So does "portable", which every processor
/// supports, on all of them.
std::vector<std::string> SimdPaths();

/// The path in use: the first of SimdPaths, unless UseSimdPath chose another.
std::string SimdPath();

/// Switches to another path. No kernel may be running. Throws BadInput if this processor does not
/// support the path.
void UseSimdPath(std::string_view path);

/// Switches to the first of SimdPaths. Returns true.
bool UseBestSimdPath();

#ifdef __aarch64__
// On processors without instructions for cryptography, Highway would not choose NEON.
inline const bool kUsesBestSimdPath = UseBestSimdPath();
#endif

}  // namespace upswing
