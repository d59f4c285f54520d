// Helpers for registers full of numbers, compiled for each instruction set.

#if defined(UPSWING_NN_REGISTERS_INL_H) == defined(HWY_TARGET_TOGGLE)  // once for each target
#ifdef UPSWING_NN_REGISTERS_INL_H
#undef UPSWING_NN_REGISTERS_INL_H
#else
#define UPSWING_NN_REGISTERS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>

#include "nn/real.h"

HWY_BEFORE_NAMESPACE();
namespace upswing::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::ScalableTag<Real>;
using Vec = hn::Vec<Tag>;

/// Whether a masked store leaves the other numbers untouched. Threads that write next to each other
/// need this. On other targets, Highway reads and rewrites the whole register.
constexpr bool kMasked = HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3;

/// Loads `count` numbers if kPartial, otherwise a whole register.
template <bool kPartial>
HWY_INLINE Vec Load(const Real* from, size_t count) {
  const Tag d;
  if constexpr (!kPartial) return hn::LoadU(d, from);
  if constexpr (kMasked) return hn::MaskedLoad(hn::FirstN(d, count), d, from);
  HWY_ALIGN Real lanes[HWY_LANES(Real)] = {};
  std::copy_n(from, count, lanes);
  return hn::Load(d, lanes);
}
template <bool kPartial>
HWY_INLINE void Store(Vec value, Real* to, size_t count) {
  const Tag d;
  if constexpr (!kPartial) {
    hn::StoreU(value, d, to);
  } else if constexpr (kMasked) {
    hn::BlendedStore(value, hn::FirstN(d, count), d, to);
  } else {
    HWY_ALIGN Real lanes[HWY_LANES(Real)];
    hn::Store(value, d, lanes);
    std::copy_n(lanes, count, to);
  }
}

#if HWY_TARGET != HWY_SCALAR
/// Transposes 4 × 4 floats; each register holds one row.
template <class D>
HWY_INLINE void TransposeBlocks(D d, hn::Vec<D> (&rows)[4]) {
  const hn::Repartition<double, D> pairs;
  const auto low01 = hn::BitCast(pairs, hn::InterleaveLower(d, rows[0], rows[1]));
  const auto low23 = hn::BitCast(pairs, hn::InterleaveLower(d, rows[2], rows[3]));
  const auto high01 = hn::BitCast(pairs, hn::InterleaveUpper(d, rows[0], rows[1]));
  const auto high23 = hn::BitCast(pairs, hn::InterleaveUpper(d, rows[2], rows[3]));
  rows[0] = hn::BitCast(d, hn::InterleaveLower(pairs, low01, low23));
  rows[1] = hn::BitCast(d, hn::InterleaveUpper(pairs, low01, low23));
  rows[2] = hn::BitCast(d, hn::InterleaveLower(pairs, high01, high23));
  rows[3] = hn::BitCast(d, hn::InterleaveUpper(pairs, high01, high23));
}

/// Loads four floats of every fourth row: block b of the register is from row 4 b.
template <class D>
HWY_INLINE hn::Vec<D> LoadBlocks(D d, const hn::TFromD<D>* from, ptrdiff_t stride) {
  if constexpr (hn::MaxLanes(d) <= 4) {
    return hn::LoadU(d, from);
  } else {
    const hn::Half<D> half;
    const hn::TFromD<D>* upper = from + static_cast<ptrdiff_t>(hn::MaxLanes(half)) * stride;
    return hn::Combine(d, LoadBlocks(half, upper, stride), LoadBlocks(half, from, stride));
  }
}

/// Loads four columns of as many rows as a register has numbers; each register holds one column.
template <class D>
HWY_INLINE void LoadColumns(D d, const hn::TFromD<D>* from, ptrdiff_t stride,
                            hn::Vec<D> (&columns)[4]) {
  HWY_UNROLL(4)
  for (int i = 0; i < 4; ++i) columns[i] = LoadBlocks(d, from + i * stride, stride);
  TransposeBlocks(d, columns);
}
#endif

// Passes over vectors. Each pass applies `f(i, count, partial)` to whole registers. Then it applies
// f with partial = true to the `count` numbers that remain.

template <typename F>
HWY_INLINE void ForVectors(size_t n, const F& f) {
  const size_t lanes = hn::Lanes(Tag());
  size_t i = 0;
  for (; i + lanes <= n; i += lanes) f(i, lanes, std::false_type());
  if (i < n) f(i, n - i, std::true_type());
}

/// Numbers that are summed side by side. Targets sum in the order of a register of 16 numbers, so
/// that those with fused multiply-adds give the same bits, and those without them, too. Only the
/// page, and its trainings, have the order of their own registers.
constexpr size_t kLanes = HWY_LANES(Real);
constexpr size_t kSummed = HWY_TARGET == HWY_WASM ? kLanes : 16;
constexpr size_t kParts = kSummed / kLanes;  // registers that hold them

/// Sum of the numbers of a register: its halves are added until one number remains. The page keeps
/// the order of its first version.
template <class D>
HWY_INLINE Real SumOfRegister([[maybe_unused]] D d, hn::Vec<D> x) {
#if HWY_TARGET == HWY_SCALAR
  return hn::GetLane(x);
#elif HWY_TARGET == HWY_WASM
  return hn::GetLane(hn::SumOfLanes(d, x));
#else
  if constexpr (hn::MaxLanes(d) * sizeof(Real) > 16) {
    const hn::Half<D> half;
    return SumOfRegister(half, hn::Add(hn::LowerHalf(half, x), hn::UpperHalf(half, x)));
  } else if constexpr (sizeof(Real) == 4) {
    const auto pair = hn::Add(x, hn::Shuffle1032(x));
    return hn::GetLane(hn::Add(pair, hn::Shuffle2301(pair)));
  } else {
    return hn::GetLane(hn::Add(x, hn::Shuffle01(x)));
  }
#endif
}

/// Σ term(i, count, partial) over all vectors, in four independent sums of kSummed numbers.
template <typename F>
HWY_INLINE Real SumVectors(size_t n, const F& term) {
  const Tag d;
  Vec sum[4][kParts];
  for (auto& parts : sum) std::fill_n(parts, kParts, hn::Zero(d));
  const auto add = [&](Vec(&parts)[kParts], size_t i) HWY_ATTR {
    HWY_UNROLL(4)
    for (size_t p = 0; p < kParts; ++p) {
      parts[p] = hn::Add(parts[p], term(i + p * kLanes, kLanes, std::false_type()));
    }
  };
  size_t i = 0;
  for (; i + 4 * kSummed <= n; i += 4 * kSummed) {
    HWY_UNROLL(4)
    for (size_t k = 0; k < 4; ++k) add(sum[k], i + k * kSummed);
  }
  for (; i + kSummed <= n; i += kSummed) add(sum[0], i);
  for (size_t p = 0; i < n; ++p, i += kLanes) {
    sum[1][p] = hn::Add(sum[1][p], i + kLanes <= n ? term(i, kLanes, std::false_type())
                                                   : term(i, n - i, std::true_type()));
  }
  Vec all[kParts];
  for (size_t p = 0; p < kParts; ++p) {
    all[p] = hn::Add(hn::Add(sum[0][p], sum[1][p]), hn::Add(sum[2][p], sum[3][p]));
  }
  for (size_t half = kParts / 2; half > 0; half /= 2) {
    for (size_t p = 0; p < half; ++p) all[p] = hn::Add(all[p], all[p + half]);
  }
  return SumOfRegister(d, all[0]);
}

}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
