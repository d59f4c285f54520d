// Symbols: q1, q2 joint angles (rad; 0 hanging, q2 relative to link 1), w1, w2 their velocities
// (rad/s), tau torque of the motor (N·m), s and c sine and cosine. The suffix 12 means the sum of
// both angles. equations.h defines the plant's constants J1, J2, b, a, G1, G2, …
#include "pendulum/closed_form.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "base/simd.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pendulum/closed_form.cc"
#include <hwy/foreach_target.h>
// These includes follow foreach_target.h, which includes this file once for every target.
#include <hwy/contrib/math/math-inl.h>

#include "pendulum/sine_cosine-inl.h"

HWY_BEFORE_NAMESPACE();
namespace upswing::HWY_NAMESPACE {
namespace {

/// MuJoCo's mjMAXVAL. A state with a larger number has blown up.
constexpr double kLargestCoordinate = 1e10;

HWY_INLINE V LoadFrom(const AlignedVector<double>& x, size_t i) {
  return hn::Load(kDoubles, x.data() + i);
}

/// Whether the motor drives joint 1 (else joint 2).
HWY_INLINE hn::Mask<D> DrivesJoint1(const ClosedFormBatch& batch, size_t i) {
  return hn::Lt(LoadFrom(batch.joint, i), Constant(1.5));
}

// The operations of dynamics.inc that Highway lacks.
template <typename T>
HWY_INLINE V Number(double x) {
  return Constant(x);
}
HWY_INLINE V Atan(V x) { return hn::Atan(kDoubles, x); }

#include "pendulum/dynamics.inc"

using JointVectors = JointPair<V>;

/// The constants of the equations of motion, and the torques at both joints.
struct Dynamics {
  ManipulatorConstants<V> constants;
  JointVectors tau;  // N·m: one is the motor's, the other 0
};

HWY_INLINE Dynamics LoadDynamics(const ClosedFormBatch& batch, size_t i) {
  const V tau = LoadFrom(batch.tau, i);
  const auto at1 = DrivesJoint1(batch, i);
  return {{LoadFrom(batch.J1, i), LoadFrom(batch.J2, i), LoadFrom(batch.b, i), LoadFrom(batch.a, i),
           LoadFrom(batch.G1, i), LoadFrom(batch.G2, i), LoadFrom(batch.d1, i),
           LoadFrom(batch.d2, i), LoadFrom(batch.f1, i), LoadFrom(batch.f2, i)},
          {hn::IfThenElseZero(at1, tau), hn::IfThenZeroElse(at1, tau)}};
}

HWY_INLINE JointVectors operator+(const JointVectors& x, const JointVectors& y) {
  return {x.one + y.one, x.two + y.two};
}

/// x + h y
HWY_INLINE JointVectors Plus(const JointVectors& x, double h, const JointVectors& y) {
  return {MulAdd(Constant(h), y.one, x.one), MulAdd(Constant(h), y.two, x.two)};
}

struct State {
  JointVectors q, w;  // rad, rad/s
};

HWY_INLINE State LoadState(const ClosedFormBatch& batch, size_t i) {
  return {{LoadFrom(batch.q1, i), LoadFrom(batch.q2, i)},
          {LoadFrom(batch.w1, i), LoadFrom(batch.w2, i)}};
}

HWY_INLINE void StoreState(const State& x, size_t i, ClosedFormBatch& batch) {
  hn::Store(x.q.one, kDoubles, batch.q1.data() + i);
  hn::Store(x.q.two, kDoubles, batch.q2.data() + i);
  hn::Store(x.w.one, kDoubles, batch.w1.data() + i);
  hn::Store(x.w.two, kDoubles, batch.w2.data() + i);
}

/// The angle of the motor's joint.
HWY_INLINE V MotorAngleOf(const ClosedFormBatch& batch, size_t i, const State& x) {
  return hn::IfThenElse(DrivesJoint1(batch, i), x.q.one, x.q.two);
}

HWY_INLINE JointAngles<V> AnglesOf(const JointVectors& q) {
  const auto [s1, c1] = SineCosineOf(q.one);
  const auto [s2, c2] = SineCosineOf(q.two);
  return {s1, c1, s2, c2};
}

template <bool kFriction>
HWY_INLINE JointVectors Acceleration(const Dynamics& p, const State& x) {
  const JointAngles<V> angles = AnglesOf(x.q);
  return AccelerationUnder(NetTorque<kFriction>(p.constants, angles, x.w, p.tau),
                           MassAt(p.constants, angles.c2));
}

/// Makes one classical Runge-Kutta step of K vectors of environments, so that the processor
/// overlaps their operations. For q̈ = a(q, w), the four slopes of q are the stages' w, so that
///   q += h w + h²/6 (a1 + a2 + a3),  w += h/6 (a1 + 2 a2 + 2 a3 + a4).
template <bool kFriction, size_t K>
HWY_INLINE void RungeKuttaStep(const Dynamics (&p)[K], double h, State (&x)[K]) {
  JointVectors a1[K], a2[K], middle[K], early[K];
  State stage[K];
  HWY_UNROLL(2)
  for (size_t k = 0; k < K; ++k) {
    a1[k] = Acceleration<kFriction>(p[k], x[k]);
    stage[k] = {Plus(x[k].q, h / 2, x[k].w), Plus(x[k].w, h / 2, a1[k])};
  }
  HWY_UNROLL(2)
  for (size_t k = 0; k < K; ++k) {
    a2[k] = Acceleration<kFriction>(p[k], stage[k]);
    stage[k] = {Plus(x[k].q, h / 2, stage[k].w), Plus(x[k].w, h / 2, a2[k])};
  }
  HWY_UNROLL(2)
  for (size_t k = 0; k < K; ++k) {
    const JointVectors a3 = Acceleration<kFriction>(p[k], stage[k]);
    stage[k] = {Plus(x[k].q, h, stage[k].w), Plus(x[k].w, h, a3)};
    middle[k] = a2[k] + a3;
    early[k] = a1[k] + middle[k];
  }
  HWY_UNROLL(2)
  for (size_t k = 0; k < K; ++k) {
    const JointVectors a4 = Acceleration<kFriction>(p[k], stage[k]);
    x[k].q = Plus(Plus(x[k].q, h, x[k].w), h * h / 6, early[k]);
    x[k].w = Plus(x[k].w, h / 6, early[k] + middle[k] + a4);
  }
}

/// Makes `steps` steps with the K vectors of environments that begin at `first`.
template <bool kFriction, size_t K>
HWY_INLINE void AdvanceVectors(ClosedFormBatch& batch, int steps, size_t first, double timestep) {
  const size_t lanes = hn::Lanes(kDoubles);
  Dynamics p[K];
  State x[K];
  HWY_UNROLL(2)
  for (size_t k = 0; k < K; ++k) {
    p[k] = LoadDynamics(batch, first + k * lanes);
    x[k] = LoadState(batch, first + k * lanes);
    hn::Store(MotorAngleOf(batch, first + k * lanes, x[k]), kDoubles,
              batch.angle_before.data() + first + k * lanes);
  }
  for (int step = 0; step < steps; ++step) RungeKuttaStep<kFriction>(p, timestep, x);
  HWY_UNROLL(2)
  for (size_t k = 0; k < K; ++k) StoreState(x[k], first + k * lanes, batch);
}

template <bool kFriction>
void AdvanceAll(ClosedFormBatch& batch, int steps, size_t first, size_t last, double timestep) {
  const size_t lanes = hn::Lanes(kDoubles);
  size_t i = first;
  for (; i + lanes < last; i += 2 * lanes) AdvanceVectors<kFriction, 2>(batch, steps, i, timestep);
  if (i < last) AdvanceVectors<kFriction, 1>(batch, steps, i, timestep);
}

void AdvanceRange(ClosedFormBatch& batch, int steps, size_t first, size_t last, double timestep) {
  const auto advance = batch.dry_friction ? AdvanceAll<true> : AdvanceAll<false>;
  advance(batch, steps, first, last, timestep);
}

/// The task's results for one vector of states; each number is an array over the lanes.
struct Verdict {
  alignas(64) float obs[kObservationSize][kWidest];
  alignas(64) double terms[kRewardTerms][kWidest];
  alignas(64) double reward[kWidest], work[kWidest], inverted[kWidest], blew_up[kWidest];
};

/// The quantities that the task's formulas use.
struct Features {
  JointAngles<V> angles;
  V c12;
  V energy;  // Ê: hanging at rest 0, upright at rest 1
  V height;  // ĥ of the tip, in [-1, 1]
};

HWY_INLINE Features FeaturesOf(const ClosedFormBatch& batch, size_t i, const State& x) {
  Features features;
  features.angles = AnglesOf(x.q);
  const auto& [s1, c1, s2, c2] = features.angles;
  features.c12 = features.angles.c12();

  // E = (T1 w1² + T2 w12²)/2 + b c2 w1 w12 - G1 c1 - G2 c12, with w12 = w1 + w2
  const V half = Constant(0.5);
  const V w1 = x.w.one, w12 = x.w.one + x.w.two;
  const V squares = MulAdd(LoadFrom(batch.T1, i), w1 * w1, LoadFrom(batch.T2, i) * (w12 * w12));
  const V kinetic = MulAdd(half, squares, (LoadFrom(batch.b, i) * c2) * (w1 * w12));
  const V minus_potential = MulAdd(LoadFrom(batch.G1, i), c1, LoadFrom(batch.G2, i) * features.c12);
  features.energy = MulAdd(kinetic - minus_potential, LoadFrom(batch.energy_scale, i), half);
  features.height =
      hn::Neg(MulAdd(LoadFrom(batch.share1, i), c1, LoadFrom(batch.share2, i) * features.c12));
  return features;
}

HWY_INLINE void JudgeObservation(const Features& features, const State& x, const Scale& scale,
                                 Verdict& verdict) {
  const V obs[kObservationSize] = {features.angles.c1,
                                   features.angles.s1,
                                   x.w.one * Constant(1 / (kMaxVelocity1 * scale.velocity())),
                                   features.angles.c2,
                                   features.angles.s2,
                                   x.w.two * Constant(1 / (kMaxVelocity2 * scale.velocity())),
                                   features.energy,
                                   features.height};
  const hn::Rebind<float, D> floats;
  HWY_UNROLL(8)
  for (size_t k = 0; k < kObservationSize; ++k) {
    hn::Store(hn::DemoteTo(floats, obs[k]), floats, verdict.obs[k]);
  }
}

HWY_INLINE void JudgeReward(const Features& features, const State& x, V tau,
                            const RewardConfig& weights, const Scale& scale, Verdict& verdict) {
  const V minus_cos30 = Constant(-std::numbers::sqrt3 / 2);
  const auto inverted =
      hn::And(hn::Le(features.angles.c1, minus_cos30), hn::Le(features.c12, minus_cos30));
  hn::Store(hn::IfThenElseZero(inverted, Constant(1)), kDoubles, verdict.inverted);

  const V half = Constant(0.5);
  const double time2 = scale.time * scale.time, torque2 = scale.torque * scale.torque;
  const V velocity_cost = Constant(-0.01 * time2) * MulAdd(x.w.one, x.w.one, x.w.two * x.w.two);
  const V terms[kRewardTerms] = {
      hn::Min(hn::Max(features.energy, Constant(0)), Constant(1.5)),
      MulAdd(half, features.height, half),
      hn::IfThenElseZero(inverted, Constant(5)),
      hn::IfThenElseZero(inverted, velocity_cost),
      hn::IfThenElse(inverted, Constant(-0.05 / torque2), Constant(-0.01 / torque2)) * tau * tau,
  };
  V reward = Constant(0);
  HWY_UNROLL(5)
  for (size_t k = 0; k < kRewardTerms; ++k) {
    const V weighted = terms[k] * Constant(weights.weight[k]);
    hn::Store(weighted, kDoubles, verdict.terms[k]);
    reward = reward + weighted;
  }
  hn::Store(reward, kDoubles, verdict.reward);
}

/// Whether all numbers are within MuJoCo's limit. NaN fails, because its comparisons are false.
HWY_INLINE hn::Mask<D> IsSound(const State& x) {
  const V largest = Constant(kLargestCoordinate);
  return hn::And(hn::And(hn::Le(hn::Abs(x.q.one), largest), hn::Le(hn::Abs(x.q.two), largest)),
                 hn::And(hn::Le(hn::Abs(x.w.one), largest), hn::Le(hn::Abs(x.w.two), largest)));
}

/// Observe, RewardTerms and Inverted of task.h for one vector of environments from `i`.
HWY_INLINE void JudgeVector(const ClosedFormBatch& batch, const RewardConfig& weights, size_t i,
                            Verdict& verdict) {
  const State x = LoadState(batch, i);
  const V tau = LoadFrom(batch.tau, i);
  const Features features = FeaturesOf(batch, i, x);
  JudgeObservation(features, x, batch.scale, verdict);
  JudgeReward(features, x, tau, weights, batch.scale, verdict);
  const V turned = MotorAngleOf(batch, i, x) - LoadFrom(batch.angle_before, i);
  hn::Store(hn::Abs(tau * turned), kDoubles, verdict.work);
  hn::Store(hn::IfThenElse(IsSound(x), Constant(0), Constant(1)), kDoubles, verdict.blew_up);
}

void JudgeRange(const ClosedFormBatch& batch, const RewardConfig& weights, size_t first,
                size_t last, StepResult& result) {
  const size_t lanes = hn::Lanes(kDoubles);
  const size_t obs_size = result.next_obs.size() / result.reward.size();
  Verdict verdict;
  for (size_t i = first; i < last; i += lanes) {
    JudgeVector(batch, weights, i, verdict);
    for (size_t lane = 0; lane < std::min(lanes, last - i); ++lane) {
      const size_t env = i + lane;
      float* obs = result.next_obs.data() + env * obs_size;
      HWY_UNROLL(8)
      for (size_t k = 0; k < kObservationSize; ++k) obs[k] = verdict.obs[k][lane];
      double* terms = result.reward_terms.data() + env * kRewardTerms;
      HWY_UNROLL(5)
      for (size_t k = 0; k < kRewardTerms; ++k) terms[k] = verdict.terms[k][lane];
      result.reward[env] = verdict.reward[lane];
      result.torque[env] = batch.tau[env];
      result.work[env] = verdict.work[lane];
      result.at_goal[env] = verdict.inverted[lane] != 0 ? 1 : 0;
      result.terminated[env] = verdict.blew_up[lane] != 0 ? 1 : 0;
    }
  }
}

}  // namespace
}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace upswing {

HWY_EXPORT(AdvanceRange);
HWY_EXPORT(JudgeRange);

ClosedFormBatch::ClosedFormBatch(size_t num_envs) {
  constexpr size_t kWidest = HWY_NAMESPACE::kWidest;
  const size_t padded = (num_envs + kWidest - 1) / kWidest * kWidest;
  for (Array* array : {&q1,    &q2,    &w1, &w2, &tau,          &angle_before, &J1,    &J2,
                       &b,     &a,     &G1, &G2, &d1,           &d2,           &f1,    &f2,
                       &limit, &joint, &T1, &T2, &energy_scale, &share1,       &share2}) {
    array->resize(padded);
  }
  for (size_t i = 0; i < padded; ++i) SetPlant(i, Plant());
}

void ClosedFormBatch::SetPlant(size_t env, const Plant& plant) {
  SetManipulator(env, ManipulatorOf(plant));
  limit[env] = plant.torque_limit;
  joint[env] = plant.actuated_joint;

  const auto links = TaskLinksOf(plant);
  const auto& [m1, l1, c1, I1] = links[0];
  const auto& [m2, l2, c2, I2] = links[1];
  T1[env] = I1 + m1 * c1 * c1 + m2 * l1 * l1;
  T2[env] = I2 + m2 * c2 * c2;
  energy_scale[env] = 1 / (2 * EnergyTarget(plant));
  share1[env] = l1 / (l1 + l2);
  share2[env] = l2 / (l1 + l2);
}

void ClosedFormBatch::SetManipulator(size_t env, const Manipulator& m) {
  J1[env] = m.J1;
  J2[env] = m.J2;
  b[env] = m.b;
  a[env] = m.a;
  G1[env] = m.G1;
  G2[env] = m.G2;
  d1[env] = m.d1;
  d2[env] = m.d2;
  f1[env] = m.f1;
  f2[env] = m.f2;
  dry_friction = dry_friction || m.f1 != 0 || m.f2 != 0;
}

void ClosedFormBatch::SetState(size_t env, const PendulumState& s) {
  q1[env] = s.q1;
  q2[env] = s.q2;
  w1[env] = s.w1;
  w2[env] = s.w2;
}

void ClosedFormBatch::SetTorque(std::span<const double> torque) {
  for (size_t i = 0; i < torque.size(); ++i) tau[i] = std::clamp(torque[i], -limit[i], limit[i]);
}

void Advance(ClosedFormBatch& batch, int steps, size_t first, size_t last, double timestep) {
  HWY_DYNAMIC_DISPATCH(AdvanceRange)(batch, steps, first, last, timestep);
}

void Judge(const ClosedFormBatch& batch, const RewardConfig& weights, size_t first, size_t last,
           StepResult& result) {
  HWY_DYNAMIC_DISPATCH(JudgeRange)(batch, weights, first, last, result);
}

}  // namespace upswing
#endif  // HWY_ONCE
