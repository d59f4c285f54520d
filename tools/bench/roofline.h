#pragma once

#include <cstdint>
#include <span>

/// Limits that kernels are measured against: the processor's peak rate of multiply-adds and the
/// memory's bandwidth, with the vector instructions in use (base/simd.h).
namespace upswing {

/// Makes multiply-adds in registers at the processor's peak rate: `rounds` on each of many
/// independent chains. Returns their number. `result` depends on all of them.
int64_t MultiplyAddChains(int64_t rounds, float& result);

/// Computes a (n) = b + factor · c, where n is a multiple of 16. This is the STREAM triad
/// (McCalpin, 1995): two numbers read and one written per element.
void Triad(std::span<const float> b, std::span<const float> c, float factor, std::span<float> a);

}  // namespace upswing
