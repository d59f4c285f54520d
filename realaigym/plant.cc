#include "realaigym/plant.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "realaigym/plant.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for every target:
#include <hwy/contrib/math/math-inl.h>

#include "sim/sine_cosine-inl.h"

HWY_BEFORE_NAMESPACE();
namespace upswing::HWY_NAMESPACE {
namespace {

HWY_INLINE V From(const Lanes& x, size_t i) { return hn::Load(kDoubles, x.data() + i); }

/// A number for each joint.
struct Joints {
  V one, two;

  HWY_INLINE Joints Plus(double h, const Joints& other) const {
    return {MulAdd(Constant(h), other.one, one), MulAdd(Constant(h), other.two, two)};
  }
};

struct State {
  Joints q, w;
};

HWY_INLINE State StateAt(const BoardBlock& block, size_t i) {
  return {{From(block.q1, i), From(block.q2, i)}, {From(block.w1, i), From(block.w2, i)}};
}

/// M(q) q̈ = f(q, q̇, τ), solved for q̈; with kFriction also what depends on it.
template <bool kFriction>
HWY_INLINE Joints Acceleration(const BoardBlock& block, size_t i, const State& x,
                               V* tip = nullptr) {
  const auto [s1, c1] = SineCosineOf(x.q.one);
  const auto [s2, c2] = SineCosineOf(x.q.two);
  const auto& [w1, w2] = x.w;
  const V s12 = MulAdd(s1, c2, c1 * s2);
  if (tip != nullptr) {
    const V c12 = NegMulAdd(s1, s2, c1 * c2);
    *tip = hn::Neg(MulAdd(From(block.length1, i), c1, From(block.length2, i) * c12));
  }
  const V b = From(block.b, i);
  const V bc = b * c2, bs = b * s2;
  const V M11 = MulAdd(Constant(2), bc, From(block.A, i));
  const V M12 = From(block.C, i) + bc;
  const V M22 = From(block.D, i);

  // f1 = τ1 + b s2 (2 w1 + w2) w2 - G1 s1 - G2 s12, f2 = τ2 - b s2 w1² - G2 s12, less friction
  const V g2 = From(block.G2, i) * s12;
  V f1 = MulAdd(bs, MulAdd(Constant(2), w1, w2) * w2,
                NegMulAdd(From(block.G1, i), s1, From(block.tau1, i)) - g2);
  V f2 = From(block.tau2, i) - MulAdd(bs, w1 * w1, g2);
  if constexpr (kFriction) {
    const V slope = Constant(kBoardFrictionSlope);
    f1 = f1 - MulAdd(From(block.d1, i), w1, From(block.cf1, i) * hn::Atan(kDoubles, slope * w1));
    f2 = f2 - MulAdd(From(block.d2, i), w2, From(block.cf2, i) * hn::Atan(kDoubles, slope * w2));
  }
  const V inverse = Constant(1) / NegMulAdd(M12, M12, M11 * M22);
  return {NegMulAdd(M12, f2, M22 * f1) * inverse, NegMulAdd(M12, f1, M11 * f2) * inverse};
}

/// One Runge-Kutta step; the slopes of q are the w of the stages, as in sim/closed_form.cc.
template <bool kFriction>
HWY_INLINE void StepVector(BoardBlock& block, size_t i) {
  constexpr double h = kBoardTimestep;
  const State x = StateAt(block, i);
  V tip;
  const Joints a1 = Acceleration<kFriction>(block, i, x, &tip);
  hn::Store(tip, kDoubles, block.tip.data() + i);
  const State second{x.q.Plus(h / 2, x.w), x.w.Plus(h / 2, a1)};
  const Joints a2 = Acceleration<kFriction>(block, i, second);
  const State third{x.q.Plus(h / 2, second.w), x.w.Plus(h / 2, a2)};
  const Joints a3 = Acceleration<kFriction>(block, i, third);
  const State last{x.q.Plus(h, third.w), x.w.Plus(h, a3)};
  const Joints a4 = Acceleration<kFriction>(block, i, last);
  const Joints q = x.q.Plus(h, x.w).Plus(h * h / 6, a1).Plus(h * h / 6, a2).Plus(h * h / 6, a3);
  const Joints w = x.w.Plus(h / 6, a1).Plus(h / 3, a2).Plus(h / 3, a3).Plus(h / 6, a4);
  hn::Store(q.one, kDoubles, block.q1.data() + i);
  hn::Store(q.two, kDoubles, block.q2.data() + i);
  hn::Store(w.one, kDoubles, block.w1.data() + i);
  hn::Store(w.two, kDoubles, block.w2.data() + i);
}

void AdvanceBlock(BoardBlock& block) {
  const size_t lanes = hn::Lanes(kDoubles);
  if (block.friction) {
    for (size_t i = 0; i < kBoardBlock; i += lanes) StepVector<true>(block, i);
  } else {
    for (size_t i = 0; i < kBoardBlock; i += lanes) StepVector<false>(block, i);
  }
}

void AccelerateBlock(const BoardBlock& block, std::array<Lanes, 2>& result) {
  for (size_t i = 0; i < kBoardBlock; i += hn::Lanes(kDoubles)) {
    const Joints a = Acceleration<true>(block, i, StateAt(block, i));
    hn::StoreU(a.one, kDoubles, result[0].data() + i);
    hn::StoreU(a.two, kDoubles, result[1].data() + i);
  }
}

}  // namespace
}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace upswing {

HWY_EXPORT(AdvanceBlock);
HWY_EXPORT(AccelerateBlock);

BoardBlock::BoardBlock() {
  for (size_t lane = 0; lane < kBoardBlock; ++lane) SetPlant(lane, BoardPlant());
}

void BoardBlock::SetPlant(size_t lane, const BoardPlant& p) {
  const double J = p.rotor_inertia, gear = kBoardGearRatio;
  A[lane] = p.inertia1 + p.inertia2 + p.mass2 * p.length1 * p.length1 + (gear * gear + 1) * J;
  b[lane] = p.mass2 * p.length1 * p.center2;
  C[lane] = p.inertia2 - gear * J;
  D[lane] = p.inertia2 + gear * gear * J;
  G1[lane] = p.gravity * (p.mass1 * p.center1 + p.mass2 * p.length1);
  G2[lane] = p.gravity * p.mass2 * p.center2;
  d1[lane] = p.damping1;
  d2[lane] = p.damping2;
  cf1[lane] = p.friction1;
  cf2[lane] = p.friction2;
  length1[lane] = p.length1;
  length2[lane] = p.length2;
  friction = friction || p.has_friction();
}

void BoardBlock::SetState(size_t lane, const BoardState& s) {
  q1[lane] = s[0];
  q2[lane] = s[1];
  w1[lane] = s[2];
  w2[lane] = s[3];
}

void Advance(BoardBlock& block) { HWY_DYNAMIC_DISPATCH(AdvanceBlock)(block); }

std::array<Lanes, 2> Accelerations(const BoardBlock& block) {
  std::array<Lanes, 2> result;
  HWY_DYNAMIC_DISPATCH(AccelerateBlock)(block, result);
  return result;
}

double Energy(const BoardPlant& p, const BoardState& s) {
  const auto& [q1, q2, w1, w2] = s;
  const double M12 = p.inertia2 + p.mass2 * p.length1 * p.center2 * std::cos(q2);
  const double M11 = p.inertia1 + p.mass2 * p.length1 * p.length1 + 2 * M12 - p.inertia2;
  const double kinetic = 0.5 * M11 * w1 * w1 + M12 * w1 * w2 + 0.5 * p.inertia2 * w2 * w2;
  const double moment1 = p.mass1 * p.center1 + p.mass2 * p.length1;
  return kinetic - p.gravity * (moment1 * std::cos(q1) + p.mass2 * p.center2 * std::cos(q1 + q2));
}

}  // namespace upswing
#endif  // HWY_ONCE
