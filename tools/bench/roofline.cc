#include "tools/bench/bench.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tools/bench/roofline.cc"
#include <hwy/foreach_target.h>  // includes this file once per target
// must come after foreach_target.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace upswing::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Vec = hn::Vec<Floats>;

int64_t MultiplyAddChains(int64_t rounds, float& result) {
  // Enough chains to hide the latency, and few enough for 16 registers. Each chain converges to its
  // own fixed point, so that no number overflows or becomes denormal.
  constexpr int kChains = 12;
  const Floats d;
  const Vec factor = hn::Set(d, 0.75F);
  const Vec addend = hn::Set(d, 0.25F);
  Vec x[kChains];
  HWY_UNROLL(12)
  for (int i = 0; i < kChains; ++i) x[i] = hn::Set(d, static_cast<float>(i));
  for (int64_t round = 0; round < rounds; ++round) {
    HWY_UNROLL(12)
    for (Vec& chain : x) chain = hn::MulAdd(chain, factor, addend);
  }
  for (int i = 1; i < kChains; ++i) x[0] = hn::Add(x[0], x[i]);
  result = hn::GetLane(hn::SumOfLanes(d, x[0]));
  return rounds * kChains * static_cast<int64_t>(hn::Lanes(d));
}

}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace upswing {

HWY_EXPORT(MultiplyAddChains);

int64_t MultiplyAddChains(int64_t rounds, float& result) {
  return HWY_DYNAMIC_DISPATCH(MultiplyAddChains)(rounds, result);
}

}  // namespace upswing
#endif  // HWY_ONCE
