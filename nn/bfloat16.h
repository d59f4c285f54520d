#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/matrix.h"

/// Products of linear layers whose operands are rounded to bfloat16 and whose sums are float, on
/// processors that have instructions for it: AVX512_BF16 ("avx512_bf16"), and on some also AMX
/// ("amx"), which multiplies whole tiles of 32 × 32 and leaves the margins to AVX512_BF16. The two
/// add in different orders, so equal bits need equal slices of a batch. B = batch size.
///
/// These instructions take pairs of consecutive numbers in the direction of the sum. A matrix of
/// pairs (⌈n/2⌉ × m) holds rows 2i and 2i+1 of an n × m matrix in its row i, the first in the low
/// half; an odd last row is paired with zeros.
namespace upswing {

/// The kinds of bfloat16 instructions that this processor has, best first; none on most.
std::vector<std::string> Bfloat16Paths();

/// Switches to another kind than the first, for tests and benchmarks; no kernel may be running.
/// Throws BadInput if this processor does not have it.
void UseBfloat16Path(std::string_view path);

/// Rows of a matrix of pairs of n rows.
inline int PairsIn(int n) { return (n + 1) / 2; }

/// pairs (⌈n/2⌉ × m) = x (n × m) rounded to bfloat16.
void PackPairs(Matrix<const float> x, Matrix<uint32_t> pairs);

/// LinearForward (nn/linear.h) with W given as pairs (⌈in/2⌉ × out).
void LinearForwardBfloat16(Matrix<const float> x, Matrix<const uint32_t> w_pairs,
                           std::span<const float> b, bool relu, Matrix<float> y);

/// LinearBackwardInput with Wᵀ given as pairs (⌈out/2⌉ × in).
void LinearBackwardInputBfloat16(Matrix<const float> dy, Matrix<const uint32_t> w_transposed_pairs,
                                 Matrix<const float> gate, Matrix<float> dx);

/// LinearBackwardWeight; x and dy are rounded to bfloat16 first.
void LinearBackwardWeightBfloat16(Matrix<const float> x, Matrix<const float> dy, Matrix<float> dw);

}  // namespace upswing
