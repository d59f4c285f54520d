#pragma once

#include <cstdint>

/// The limit that gradient steps are measured against: the processor's peak rate of multiply-adds,
/// with the vector instructions in use (base/simd.h).
namespace upswing {

/// Makes multiply-adds in registers at the processor's peak rate: `rounds` on each of many
/// independent chains. Returns their number. `result` depends on all of them.
int64_t MultiplyAddChains(int64_t rounds, float& result);

}  // namespace upswing
