#pragma once

#include <cstdint>
#include <span>

/// The limits that kernels are measured against: the processor's peak rate of multiply-adds and the
/// memory's bandwidth, with the vector instructions in use (core/simd.h).
namespace upswing {

/// Multiply-adds in registers, `rounds` on each of many independent chains, at the processor's peak
/// rate. Returns their number; `result` depends on all of them.
int64_t MultiplyAddChains(int64_t rounds, float& result);

/// a (n) = b + factor · c, n a multiple of 16: two numbers read and one written for each, the
/// STREAM triad (McCalpin, 1995).
void Triad(std::span<const float> b, std::span<const float> c, float factor, std::span<float> a);

}  // namespace upswing
