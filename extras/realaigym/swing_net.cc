#include "extras/realaigym/swing_net.h"

#include <algorithm>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "extras/realaigym/swing_net.cc"
#include <hwy/foreach_target.h>
// These includes follow foreach_target.h, which includes this file once for every target.
#include "pendulum/sine_cosine-inl.h"

HWY_BEFORE_NAMESPACE();
namespace upswing::HWY_NAMESPACE {

using namespace realaigym;
namespace {

using F = hn::CappedTag<float, 16>;
using VF = hn::Vec<F>;
inline constexpr F kFloats;

/// The network's inputs (kSwingInputs × kBoardBlock) and outputs (kBoardBlock).
struct Activations {
  alignas(64) float in[kSwingInputs][kBoardBlock];
  alignas(64) float out[kBoardBlock];
};

HWY_INLINE V From(const Lanes& x, size_t i) { return hn::LoadU(kDoubles, x.data() + i); }
HWY_INLINE void To(V x, Lanes& lanes, size_t i) { hn::StoreU(x, kDoubles, lanes.data() + i); }

/// x (27 + x²)/(27 + 9 x²) within ±3, ±1 beyond: close to tanh, with a continuous slope. Handles
/// two vectors at once, because division takes longer than everything else.
HWY_INLINE void Squash(VF& a, VF& b) {
  const VF limit = hn::Set(kFloats, 3.0F), c = hn::Set(kFloats, 27.0F),
           nine = hn::Set(kFloats, 9.0F);
  const VF x = hn::Max(hn::Min(a, limit), hn::Neg(limit));
  const VF y = hn::Max(hn::Min(b, limit), hn::Neg(limit));
  const VF xx = x * x, yy = y * y;
  const VF below_a = hn::MulAdd(nine, xx, c), below_b = hn::MulAdd(nine, yy, c);
  const VF inverse = hn::Set(kFloats, 1.0F) / (below_a * below_b);
  a = x * (c + xx) * below_b * inverse;
  b = y * (c + yy) * below_a * inverse;
}

/// The velocity from the last three angles, to second order, rad/s.
HWY_INLINE V Velocity(const std::array<Lanes, 2>& past, V now, size_t i) {
  const V sum =
      MulAdd(Constant(3), now, NegMulAdd(Constant(4), From(past[0], i), From(past[1], i)));
  return sum * Constant(1 / (2 * kBoardTimestep));
}

/// An angle in [-π, π].
HWY_INLINE V Wrap(V x) {
  const V turns = hn::Round(x * Constant(1 / (2 * std::numbers::pi)));
  return NegMulAdd(turns, Constant(2 * std::numbers::pi), x);
}

/// Consecutive weights: of one policy or, with kOwn, one for each lane.
template <bool kOwn>
class Reader {
 public:
  HWY_INLINE explicit Reader(const float* weights) : next_(weights) {}
  HWY_INLINE VF operator()() {
    const float* here = next_;
    next_ += kOwn ? kBoardBlock : 1;
    return kOwn ? hn::Load(kFloats, here) : hn::Set(kFloats, *here);
  }

 private:
  const float* next_;
};

/// A unit with n inputs: weights, then bias.
template <bool kOwn>
HWY_INLINE VF Unit(Reader<kOwn>& weight, const VF* in, int n) {
  VF even = weight() * in[0], odd = weight() * in[1];
  for (int j = 2; j < n; j += 2) {
    even = hn::MulAdd(weight(), in[j], even);
    odd = hn::MulAdd(weight(), in[j + 1], odd);
  }
  return even + odd + weight();
}

template <bool kOwn>
HWY_INLINE void Layer(Reader<kOwn>& weight, const VF* in, int n, VF* out, int hidden) {
  for (int j = 0; j < hidden; j += 2) {
    out[j] = Unit(weight, in, n);
    out[j + 1] = Unit(weight, in, n);
    Squash(out[j], out[j + 1]);
  }
}

/// Evaluates a layer. kHidden: number of units if the compiler should know it, or 0.
template <bool kOwn, int kHidden>
void Network(const SwingBlock& block, Activations& a) {
  const int hidden = kHidden > 0 ? kHidden : block.hidden;
  for (size_t lane = 0; lane < kBoardBlock; lane += hn::Lanes(kFloats)) {
    const size_t policy = lane / block.lanes_each;
    const float* weights = block.weights.data();
    Reader<kOwn> weight(kOwn ? weights + lane : weights + policy * SwingWeights(hidden));
    VF in[kSwingInputs], first[kSwingMostHidden], second[kSwingMostHidden];
    for (int j = 0; j < kSwingInputs; ++j) in[j] = hn::Load(kFloats, a.in[j] + lane);
    Layer(weight, in, kSwingInputs, first, hidden);
    Layer(weight, first, hidden, second, hidden);
    VF out = Unit(weight, second, hidden) * hn::Set(kFloats, 0.5F), unused = out;
    Squash(out, unused);
    hn::Store(out * hn::Set(kFloats, static_cast<float>(kSwingTorque)), kFloats, a.out + lane);
  }
}

/// The linear torque and its share in the blend.
struct Linear {
  V share, torque;
};

HWY_INLINE Linear LinearTorque(const SwingBlock& block, size_t i, const V (&x)[4]) {
  V cost = Constant(0), torque = Constant(0);
  for (size_t r = 0; r < 4; ++r) {
    V row = Constant(0);
    for (size_t c = 0; c < 4; ++c) row = MulAdd(Constant(block.P[4 * r + c]), x[c], row);
    cost = MulAdd(row, x[r], cost);
    torque = NegMulAdd(From(block.K[r], i), x[r], torque);
  }
  // A smooth step from 0 to 1.
  const V inside = NegMulAdd(cost, From(block.inverse_rho, i), Constant(1));
  const V z = hn::Min(hn::Max(MulAdd(From(block.sharpness, i), inside, Constant(0.5)), Constant(0)),
                      Constant(1));
  return {z * z * NegMulAdd(Constant(2), z, Constant(3)), torque};
}

void ActOnBlock(SwingBlock& block, const BoardMeasurement& measured, Lanes& torque) {
  Activations a;
  Lanes w1, w2, sides;  // sides: -1 where the network sees the mirror image, else 1
  const hn::Rebind<float, D> halves;
  for (size_t i = 0; i < kBoardBlock; i += hn::Lanes(kDoubles)) {
    const V q1 = From(measured.q1, i), q2 = From(measured.q2, i);
    const V v1 = Velocity(block.q1, q1, i), v2 = Velocity(block.q2, q2, i);
    const auto [sine1, c1] = SineCosineOf(q1);
    const auto [sine2, c2] = SineCosineOf(q2);
    const V side =
        hn::IfThenElse(hn::Abs(q1) > Constant(block.mirrored_beyond), Constant(-1), Constant(1));
    const V s1 = side * sine1, s2 = side * sine2, tenth = side * Constant(0.1);
    const V in[kSwingInputs] = {
        s1,         c1,        MulAdd(s1, c2, c1 * s2), NegMulAdd(s1, s2, c1 * c2), s2, c2,
        tenth * v1, tenth * v2};
    for (int j = 0; j < kSwingInputs; ++j) {
      hn::Store(hn::DemoteTo(halves, in[j]), halves, a.in[j] + i);
    }
    To(side, sides, i);
    To(v1, w1, i);
    To(v2, w2, i);
    To(From(block.q1[0], i), block.q1[1], i);
    To(From(block.q2[0], i), block.q2[1], i);
    To(q1, block.q1[0], i);
    To(q2, block.q2[0], i);
  }
  if (block.lanes_each == 1) {
    Network<true, 0>(block, a);
  } else if (block.hidden == 16) {
    Network<false, 16>(block, a);
  } else {
    Network<false, 0>(block, a);
  }
  for (size_t i = 0; i < kBoardBlock; i += hn::Lanes(kDoubles)) {
    const V x[4] = {Wrap(From(measured.q1, i) - Constant(std::numbers::pi)),
                    Wrap(From(measured.q2, i)), From(w1, i), From(w2, i)};
    const Linear linear = LinearTorque(block, i, x);
    const V net = From(sides, i) * hn::PromoteTo(kDoubles, hn::Load(halves, a.out + i));
    // Outside its region the linear torque may be large, so it is clipped first.
    const V limit = Constant(kBoardTorqueLimit);
    const V cut = hn::Min(hn::Max(linear.torque, hn::Neg(limit)), limit);
    To(MulAdd(linear.share, cut - net, net), torque, i);
  }
}

}  // namespace
}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace upswing::realaigym {

HWY_EXPORT(ActOnBlock);

void SwingTorques(SwingBlock& block, const BoardMeasurement& measured, Lanes& torque) {
  HWY_DYNAMIC_DISPATCH(ActOnBlock)(block, measured, torque);
}

}  // namespace upswing::realaigym
#endif  // HWY_ONCE
