#pragma once

#include <cstdint>
#include <span>

/// What kernels can be measured against: how fast the processor multiplies and how fast memory is,
/// on the vector instructions in use (core/simd.h).
namespace upswing {

/// Multiply-adds in registers, `rounds` on each of many independent chains: as fast as the
/// processor can. Returns how many it made; `result` depends on all of them.
int64_t MultiplyAddChains(int64_t rounds, float& result);

/// a (n) = b + factor · c, n a multiple of 16: two numbers read and one written for each, the
/// STREAM triad (McCalpin, 1995).
void Triad(std::span<const float> b, std::span<const float> c, float factor, std::span<float> a);

}  // namespace upswing
