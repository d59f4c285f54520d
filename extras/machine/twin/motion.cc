#include "extras/machine/twin/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unsupported/Eigen/AutoDiff>

#include "pendulum/regressor.h"
#include "pendulum/runge_kutta.h"
#include "pendulum/timestep.h"

namespace upswing::machine {
namespace {

// Largest decay by friction in a step (FastestDecayOf). Near rest dry friction is 13 times steeper.
constexpr double kFollowedDecay = 0.1;

using StateTangents = TangentMatrix<4>;
using JointTangents = TangentMatrix<2>;

/// The derivative of DryFriction(1, w) by w, s/rad.
double FrictionSlope(double w) {
  return kFrictionSlope / (1 + kFrictionSlope * kFrictionSlope * w * w);
}

/// ∂F/∂(q1, q2, w1, w2) of F = M q̈ + c + g + d q̇ + f atan(100 q̇) - cogging at both joints, with q̈
/// held. Dry friction and cogging, whose slope is given, are added to the derivatives of the rest,
/// because dual numbers take longer for them.
Eigen::Matrix<double, 4, 2> ForceByState(const Manipulator& m, const PendulumState& s,
                                         const Joints& a, const Joints& cogging_slope) {
  using Dual = Eigen::AutoDiffScalar<Eigen::Vector4d>;
  using Pair = dynamics::JointPair<Dual>;
  const Pair q{{s.q1, 4, 0}, {s.q2, 4, 1}}, w{{s.w1, 4, 2}, {s.w2, 4, 3}};
  const auto angles = dynamics::AnglesOf(q);
  const auto M = dynamics::MassAt(m, angles.c2);
  const Pair net = dynamics::NetTorque</*kFriction=*/false>(m, angles, w, {Dual(0), Dual(0)});
  const Dual F1 = M.M11 * a[0] + M.M12 * a[1] - net.one;
  const Dual F2 = M.M12 * a[0] + M.M22 * a[1] - net.two;
  Eigen::Matrix<double, 4, 2> derivatives;
  derivatives << F1.derivatives(), F2.derivatives();
  derivatives(2, 0) += m.f1 * FrictionSlope(s.w1);
  derivatives(3, 1) += m.f2 * FrictionSlope(s.w2);
  derivatives(0, 0) -= cogging_slope[0];
  derivatives(1, 1) -= cogging_slope[1];
  return derivatives;
}

/// Derivatives of the acceleration q̈ in state s, from those of the state. The equations of motion
/// F(q̈, s, p) = τ are linear in the constants p, so M dq̈ = dτ - ∂F/∂s ds - Y dp.
JointTangents AccelerationTangents(const Body& m, const PendulumState& s, const Joints& a,
                                   const DriveTangents& torque, const StateTangents& state) {
  const auto angles = dynamics::AnglesOf<double>({s.q1, s.q2});
  const Factors Y = Regressor(angles, {s.w1, s.w2}, {a[0], a[1]});
  const Joints q{s.q1, s.q2}, slope = m.cogging.SlopeAt(q);
  JointTangents force = state.lazyProduct(ForceByState(m, s, a, slope));
  for (int j = 0; j < 2; ++j) {
    force.col(j).segment<kNumManipulatorConstants>(tangent::kBody) +=
        Eigen::Map<const Eigen::Vector<double, kNumManipulatorConstants>>(Y[j].data());
    force(tangent::kDelay, j) -= torque.by_delay[j];
    force(tangent::kLag, j) -= torque.by_lag[j];
    if (m.detail == Detail::kUsual) continue;
    force(tangent::kOffset + j, j) -= 1;
    if (m.detail == Detail::kOffsets) continue;
    const auto factors = m.cogging.Factors(j, q[j]);
    force.col(j).segment<Cogging::kCoefficients>(tangent::kCogging + j * Cogging::kCoefficients) -=
        Eigen::Map<const Eigen::Vector<double, Cogging::kCoefficients>>(factors.data());
    force(tangent::kZero + j, j) -= slope[j];
  }
  const MassMatrix M = m.Mass(angles.c2);
  Eigen::Matrix2d inverse;
  inverse << M.M22, -M.M12, -M.M12, M.M11;
  return force.lazyProduct(inverse / -M.det);
}

/// The derivatives of the rate of a state: q̇1, q̇2, q̈1, q̈2.
StateTangents RateOf(const PointTangents& point) {
  StateTangents rate(point.state.rows(), 4);
  rate << point.state.rightCols<2>(), point.acceleration;
  return rate;
}

/// A step of a prediction. Derivatives are filled if `has_tangents`.
struct PredictedStep {
  double h = 0;  // length, s
  bool is_last = false;
  MotionPoint before, after;
  bool has_tangents = false;
  PointTangents tangents_before, tangents_after;

  /// Begins the next step with the point after this one, which the integration then takes further.
  void Follow() {
    before = after;
    if (has_tangents) tangents_before = tangents_after;
  }
  /// Whether a moment (s) is in this step or an earlier one, or later than the last one.
  bool Reaches(double moment) const { return is_last || moment < before.time + h; }
  /// The moment's place in the step, from 0 to 1.
  double ShareOf(double moment) const { return std::clamp((moment - before.time) / h, 0.0, 1.0); }
};

/// Fills angles and velocities of row k at a moment (s) of the step.
void FillAngles(const PredictedStep& step, double moment, const Joints& zero, int k, Motion& motion,
                MotionTangents* tangents) {
  const double share = step.ShareOf(moment), h = step.h;
  const PendulumState s = StateBetween(step.before.state, step.after.state, h, share);
  motion.angle[k] = {s.q1 + zero[0], s.q2 + zero[1]};
  motion.velocity[k] = {s.w1, s.w2};
  if (tangents == nullptr) return;
  // The cubic of StateBetween.
  const StateTangents &before = step.tangents_before.state, &after = step.tangents_after.state;
  const double rest = 1 - share, a = rest * rest, b = share * share;
  tangents->angle.middleCols<2>(2 * k) =
      a * (1 + 2 * share) * before.leftCols<2>() + b * (1 + 2 * rest) * after.leftCols<2>() +
      h * share * rest * (rest * before.rightCols<2>() - share * after.rightCols<2>());
}

/// Fills the acceleration of row k at a moment (s) of the step.
void FillAcceleration(const PredictedStep& step, double moment, int k, Motion& motion,
                      MotionTangents* tangents) {
  const double share = step.ShareOf(moment);
  const Joints &before = step.before.acceleration, &after = step.after.acceleration;
  for (int j = 0; j < 2; ++j) {
    motion.acceleration[k][j] = before[j] + share * (after[j] - before[j]);
    if (tangents != nullptr) tangents->jerk[k][j] = (after[j] - before[j]) / step.h;
  }
  if (tangents == nullptr) return;
  tangents->acceleration.middleCols<2>(2 * k) =
      (1 - share) * step.tangents_before.acceleration + share * step.tangents_after.acceleration;
}

}  // namespace

int Body::tangents() const {
  switch (detail) {
    case Detail::kUsual:
      return tangent::kOffset;
    case Detail::kOffsets:
      return tangent::kCogging;
    case Detail::kCogging:
      return tangent::kRows;
  }
  return tangent::kRows;
}

Joints Body::Acceleration(const PendulumState& s, const Joints& torque) const {
  Joints all = torque;
  if (offset != Joints{}) all = {all[0] + offset[0], all[1] + offset[1]};
  if (cogging.any()) {
    const Joints magnets = cogging.At({s.q1, s.q2});
    all = {all[0] + magnets[0], all[1] + magnets[1]};
  }
  return Manipulator::Acceleration(s, all);
}

Body BodyOf(const Twin& twin, bool reported) {
  Body body{ManipulatorOf(twin.plant),
            CoggingTorque(twin.cogging, {twin.sensors.zero1, twin.sensors.zero2}),
            {twin.actuator.torque_offset1, twin.actuator.torque_offset2}};
  if (twin.cogging.any()) body.detail = Detail::kCogging;
  if (reported) {
    body.J1 -= twin.actuator.current_inertia;
    body.a -= twin.actuator.current_inertia;
  }
  const double decay = FastestDecayOf(body).rate;
  while (body.longest_step > kShortestMotionStep && decay * body.longest_step > kFollowedDecay) {
    body.longest_step /= 2;
  }
  return body;
}

int MotionSteps(const Body& body, double seconds) {
  return std::max(1, static_cast<int>(std::ceil(seconds / body.longest_step - 1e-9)));
}

MotionPoint MotionIntegrator::Start(double time, const PendulumState& state) {
  return {time, state, body_.Acceleration(state, drive_.At(time, cursor_))};
}

MotionPoint MotionIntegrator::Start(double time, const PendulumState& state,
                                    PointTangents& tangents) {
  DriveTangents of_torque;
  const Joints torque = drive_.At(time, cursor_, &of_torque);
  const MotionPoint point{time, state, body_.Acceleration(state, torque)};
  tangents.state.setIdentity(body_.tangents(), 4);
  tangents.acceleration =
      AccelerationTangents(body_, state, point.acceleration, of_torque, tangents.state);
  return point;
}

MotionPoint MotionIntegrator::Step(const MotionPoint& now, double h) {
  const Joints half = drive_.At(now.time + h / 2, cursor_);
  const Joints full = drive_.At(now.time + h, cursor_);
  const PendulumState next =
      RungeKuttaStep(now.state, now.acceleration, h, [&](const PendulumState& s, double share) {
        return body_.Acceleration(s, share < 1 ? half : full);
      });
  return {now.time + h, next, body_.Acceleration(next, full)};
}

MotionPoint MotionIntegrator::Step(const MotionPoint& now, double h, PointTangents& tangents) {
  DriveTangents of_half, of_full;
  const Joints half = drive_.At(now.time + h / 2, cursor_, &of_half);
  const Joints full = drive_.At(now.time + h, cursor_, &of_full);
  // RungeKuttaStep asks for the accelerations of the stages 2, 3 and 4. Each stage begins at the
  // start and goes the share of the step with the rate of the stage before it.
  constexpr std::array kWeights{1, 2, 2, 1};
  PointTangents stage = tangents;
  StateTangents rates = RateOf(stage);  // sum with the weights
  size_t stages = 1;
  const auto acceleration_at = [&](const PendulumState& s, double share) {
    const Joints a = body_.Acceleration(s, share < 1 ? half : full);
    stage.state = tangents.state + h * share * RateOf(stage);
    stage.acceleration =
        AccelerationTangents(body_, s, a, share < 1 ? of_half : of_full, stage.state);
    rates += kWeights[stages] * RateOf(stage);
    ++stages;
    return a;
  };
  const PendulumState next = RungeKuttaStep(now.state, now.acceleration, h, acceleration_at);
  const Joints acceleration = body_.Acceleration(next, full);
  tangents.state += h / 6 * rates;
  tangents.acceleration = AccelerationTangents(body_, next, acceleration, of_full, tangents.state);
  return {now.time + h, next, acceleration};
}

MotionModel CommandedModel(const MachineLog& log, const Twin& twin) {
  return {BodyOf(twin), Drive::Commanded(log, twin), {twin.sensors.zero1, twin.sensors.zero2}};
}

MotionModel ReportedModel(const MachineLog& log, const Twin& twin) {
  return {BodyOf(twin, /*reported=*/true),
          Drive::Measured(log, twin),
          {twin.sensors.zero1, twin.sensors.zero2}};
}

Motion Predict(const MotionModel& model, const PendulumState& start, std::span<const double> times,
               double late, MotionTangents* tangents) {
  const int rows = static_cast<int>(times.size());
  Motion motion;
  motion.angle.resize(rows);
  motion.velocity.resize(rows);
  motion.acceleration.resize(rows);
  if (tangents != nullptr) {
    tangents->angle.resize(model.body.tangents(), 2 * rows);
    tangents->acceleration.resize(model.body.tangents(), 2 * rows);
    tangents->jerk.resize(rows);
  }
  const double begin = times.front(), seconds = times.back() - begin;
  const int steps = MotionSteps(model.body, seconds);
  PredictedStep step;
  step.h = std::max(seconds / steps, 1e-9);
  step.has_tangents = tangents != nullptr;

  MotionIntegrator integrator(model.body, model.drive);
  PendulumState state = start;
  state.q1 -= model.zero[0];
  state.q2 -= model.zero[1];
  step.after = step.has_tangents ? integrator.Start(begin, state, step.tangents_after)
                                 : integrator.Start(begin, state);
  int row = 0, late_row = 0;
  for (int i = 0; i < steps; ++i) {
    step.Follow();
    step.before.time = begin + i * step.h;  // a sum of steps would have rounding errors
    step.is_last = i + 1 == steps;
    step.after = step.has_tangents ? integrator.Step(step.before, step.h, step.tangents_after)
                                   : integrator.Step(step.before, step.h);
    for (; row < rows && step.Reaches(times[row]); ++row) {
      FillAngles(step, times[row], model.zero, row, motion, tangents);
    }
    for (; late_row < rows && step.Reaches(times[late_row] - late); ++late_row) {
      FillAcceleration(step, times[late_row] - late, late_row, motion, tangents);
    }
  }
  return motion;
}

}  // namespace upswing::machine
