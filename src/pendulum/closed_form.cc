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

/// The constants of the equations of motion.
struct Dynamics {
  V J2, b, G1, G2, d1, d2, f1, f2;
  V tau1, tau2;  // torques at both joints, N·m: one is the motor's, the other 0
  V a2;          // 2 a
  V J12;         // J1 + J2
  V M22;         // J2 + a
  V det;         // part of det M that does not depend on q2
};

HWY_INLINE Dynamics LoadDynamics(const ClosedFormBatch& batch, size_t i) {
  Dynamics p;
  const V J1 = LoadFrom(batch.J1, i);
  p.J2 = LoadFrom(batch.J2, i);
  p.b = LoadFrom(batch.b, i);
  p.G1 = LoadFrom(batch.G1, i);
  p.G2 = LoadFrom(batch.G2, i);
  p.d1 = LoadFrom(batch.d1, i);
  p.d2 = LoadFrom(batch.d2, i);
  p.f1 = LoadFrom(batch.f1, i);
  p.f2 = LoadFrom(batch.f2, i);
  const V tau = LoadFrom(batch.tau, i);
  const auto at1 = DrivesJoint1(batch, i);
  p.tau1 = hn::IfThenElseZero(at1, tau);
  p.tau2 = hn::IfThenZeroElse(at1, tau);
  const V a = LoadFrom(batch.a, i);
  p.a2 = a + a;
  p.J12 = J1 + p.J2;
  p.M22 = p.J2 + a;
  p.det = MulAdd(J1, p.J2, a * p.J12);
  return p;
}

/// A number for each joint.
struct JointVectors {
  V one, two;

  HWY_INLINE JointVectors operator+(const JointVectors& other) const {
    return {one + other.one, two + other.two};
  }
  /// this + h other
  HWY_INLINE JointVectors Plus(double h, const JointVectors& other) const {
    return {MulAdd(Constant(h), other.one, one), MulAdd(Constant(h), other.two, two)};
  }
};

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

/// Sines and cosines of the joints' angles.
struct Angles {
  Angle q1, q2;
};

HWY_INLINE Angles AnglesOf(const JointVectors& q) {
  return {SineCosineOf(q.one), SineCosineOf(q.two)};
}

/// M(q) q̈ = r = τ - c(q, q̇) - g(q) - d q̇ - f atan(100 q̇), solved for q̈.
template <bool kFriction>
HWY_INLINE JointVectors Acceleration(const Dynamics& p, const State& x, const Angles& angles) {
  const auto& [s1, c1] = angles.q1;
  const auto& [s2, c2] = angles.q2;
  const auto& [w1, w2] = x.w;
  const V s12 = MulAdd(s1, c2, c1 * s2);

  // M = [[J1 + J2 + 2 b c2, J2 + b c2], [·, J2 + a]], so that
  // det M = J1 J2 + a (J1 + J2) + b c2 (2 a - b c2).
  const V bc = p.b * c2;
  const V M11 = MulAdd(Constant(2), bc, p.J12);
  const V M12 = p.J2 + bc;
  const V det = MulAdd(bc, p.a2 - bc, p.det);

  // r1 = τ1 + b s2 (2 w1 + w2) w2 - G1 s1 - G2 s12 - d1 w1 - f1 atan(100 w1)
  // r2 = τ2 - b s2 w1² - G2 s12 - d2 w2 - f2 atan(100 w2)
  const V bs = p.b * s2;
  const V g2 = p.G2 * s12;
  V r1 = MulAdd(bs, MulAdd(Constant(2), w1, w2) * w2,
                NegMulAdd(p.G1, s1, NegMulAdd(p.d1, w1, p.tau1)) - g2);
  V minus_r2 = MulAdd(bs, w1 * w1, MulAdd(p.d2, w2, g2)) - p.tau2;
  if constexpr (kFriction) {
    const V slope = Constant(kFrictionSlope);
    r1 = NegMulAdd(p.f1, hn::Atan(kDoubles, slope * w1), r1);
    minus_r2 = MulAdd(p.f2, hn::Atan(kDoubles, slope * w2), minus_r2);
  }

  const V inverse = Constant(1) / det;
  return {MulAdd(p.M22, r1, M12 * minus_r2) * inverse,
          hn::Neg(MulAdd(M11, minus_r2, M12 * r1)) * inverse};
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
    a1[k] = Acceleration<kFriction>(p[k], x[k], AnglesOf(x[k].q));
    stage[k] = {x[k].q.Plus(h / 2, x[k].w), x[k].w.Plus(h / 2, a1[k])};
  }
  HWY_UNROLL(2)
  for (size_t k = 0; k < K; ++k) {
    a2[k] = Acceleration<kFriction>(p[k], stage[k], AnglesOf(stage[k].q));
    stage[k] = {x[k].q.Plus(h / 2, stage[k].w), x[k].w.Plus(h / 2, a2[k])};
  }
  HWY_UNROLL(2)
  for (size_t k = 0; k < K; ++k) {
    const JointVectors a3 = Acceleration<kFriction>(p[k], stage[k], AnglesOf(stage[k].q));
    stage[k] = {x[k].q.Plus(h, stage[k].w), x[k].w.Plus(h, a3)};
    middle[k] = a2[k] + a3;
    early[k] = a1[k] + middle[k];
  }
  HWY_UNROLL(2)
  for (size_t k = 0; k < K; ++k) {
    const JointVectors a4 = Acceleration<kFriction>(p[k], stage[k], AnglesOf(stage[k].q));
    x[k].q = x[k].q.Plus(h, x[k].w).Plus(h * h / 6, early[k]);
    x[k].w = x[k].w.Plus(h / 6, early[k] + middle[k] + a4);
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
struct Pose {
  Angle q1, q2;
  V c12;
  V energy;  // Ê: hanging at rest 0, upright at rest 1
  V height;  // ĥ of the tip, in [-1, 1]
};

HWY_INLINE Pose PoseOf(const ClosedFormBatch& batch, size_t i, const State& x) {
  Pose pose;
  const Angles angles = AnglesOf(x.q);
  pose.q1 = angles.q1;
  pose.q2 = angles.q2;
  pose.c12 = NegMulAdd(pose.q1.s, pose.q2.s, pose.q1.c * pose.q2.c);

  // E = (T1 w1² + T2 w12²)/2 + b c2 w1 w12 - G1 c1 - G2 c12, with w12 = w1 + w2
  const V half = Constant(0.5);
  const V w1 = x.w.one, w12 = x.w.one + x.w.two;
  const V squares = MulAdd(LoadFrom(batch.T1, i), w1 * w1, LoadFrom(batch.T2, i) * (w12 * w12));
  const V kinetic = MulAdd(half, squares, (LoadFrom(batch.b, i) * pose.q2.c) * (w1 * w12));
  const V minus_potential =
      MulAdd(LoadFrom(batch.G1, i), pose.q1.c, LoadFrom(batch.G2, i) * pose.c12);
  pose.energy = MulAdd(kinetic - minus_potential, LoadFrom(batch.energy_scale, i), half);
  pose.height =
      hn::Neg(MulAdd(LoadFrom(batch.share1, i), pose.q1.c, LoadFrom(batch.share2, i) * pose.c12));
  return pose;
}

HWY_INLINE void JudgeObservation(const Pose& pose, const State& x, Verdict& verdict) {
  const V obs[kObservationSize] = {pose.q1.c,   pose.q1.s,  x.w.one * Constant(1 / kMaxVelocity1),
                                   pose.q2.c,   pose.q2.s,  x.w.two * Constant(1 / kMaxVelocity2),
                                   pose.energy, pose.height};
  const hn::Rebind<float, D> floats;
  HWY_UNROLL(8)
  for (size_t k = 0; k < kObservationSize; ++k) {
    hn::Store(hn::DemoteTo(floats, obs[k]), floats, verdict.obs[k]);
  }
}

HWY_INLINE void JudgeReward(const Pose& pose, const State& x, V tau, const RewardConfig& weights,
                            Verdict& verdict) {
  const V minus_cos30 = Constant(-std::numbers::sqrt3 / 2);
  const auto inverted = hn::And(hn::Le(pose.q1.c, minus_cos30), hn::Le(pose.c12, minus_cos30));
  hn::Store(hn::IfThenElseZero(inverted, Constant(1)), kDoubles, verdict.inverted);

  const V half = Constant(0.5);
  const V velocity_cost = Constant(-0.01) * MulAdd(x.w.one, x.w.one, x.w.two * x.w.two);
  const V terms[kRewardTerms] = {
      hn::Min(hn::Max(pose.energy, Constant(0)), Constant(1.5)),
      MulAdd(half, pose.height, half),
      hn::IfThenElseZero(inverted, Constant(5)),
      hn::IfThenElseZero(inverted, velocity_cost),
      hn::IfThenElse(inverted, Constant(-0.05), Constant(-0.01)) * tau * tau,
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
  const Pose pose = PoseOf(batch, i, x);
  JudgeObservation(pose, x, verdict);
  JudgeReward(pose, x, tau, weights, verdict);
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
