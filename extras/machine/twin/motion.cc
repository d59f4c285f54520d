#include "extras/machine/twin/motion.h"

#include <algorithm>
#include <cmath>
#include <unsupported/Eigen/AutoDiff>

#include "pendulum/regressor.h"
#include "pendulum/runge_kutta.h"

namespace upswing::machine {
namespace {

constexpr double kShortestLag = 1e-5;  // s; shorter lags count as this one

using StateTangents = Eigen::Matrix<double, kTangents, 4>;
using JointTangents = Eigen::Matrix<double, kTangents, 2>;

/// The derivative of DryFriction(1, w) by w, s/rad. Dual numbers would take longer for it.
double FrictionSlope(double w) {
  return kFrictionSlope / (1 + kFrictionSlope * kFrictionSlope * w * w);
}

/// ∂F/∂(q1, q2, w1, w2) of F = M q̈ + c + g + d q̇ + f atan(100 q̇) at both joints, with q̈ held.
Eigen::Matrix<double, 4, 2> ForceByState(const Manipulator& m, const PendulumState& s,
                                         const Joints& a) {
  using Dual = Eigen::AutoDiffScalar<Eigen::Vector4d>;
  using Pair = dynamics::JointPair<Dual>;
  const Pair q{{s.q1, 4, 0}, {s.q2, 4, 1}}, w{{s.w1, 4, 2}, {s.w2, 4, 3}};
  const auto angles = dynamics::AnglesOf(q);
  const auto M = dynamics::MassAt(m, angles.c2);
  const Pair net = dynamics::NetTorque<false>(m, angles, w, Pair{Dual(0), Dual(0)});
  const Dual F1 = M.M11 * a[0] + M.M12 * a[1] - net.one;
  const Dual F2 = M.M12 * a[0] + M.M22 * a[1] - net.two;
  Eigen::Matrix<double, 4, 2> derivatives;
  derivatives << F1.derivatives(), F2.derivatives();
  derivatives(2, 0) += m.f1 * FrictionSlope(s.w1);
  derivatives(3, 1) += m.f2 * FrictionSlope(s.w2);
  return derivatives;
}

/// Derivatives of the acceleration q̈ in state s, from those of the state. The equations of motion
/// F(q̈, s, p) = τ are linear in the constants p, so M dq̈ = dτ - ∂F/∂s ds - Y dp.
JointTangents AccelerationTangents(const Manipulator& m, const PendulumState& s, const Joints& a,
                                   const DriveTangents& torque, const StateTangents& state) {
  const auto angles = dynamics::AnglesOf<double>({s.q1, s.q2});
  const Factors Y = Regressor(angles, {s.w1, s.w2}, {a[0], a[1]});
  JointTangents force = state * ForceByState(m, s, a);
  for (int j = 0; j < 2; ++j) {
    force.col(j).segment<kNumManipulatorConstants>(4) +=
        Eigen::Map<const Eigen::Vector<double, kNumManipulatorConstants>>(Y[j].data());
    force(kTangents - 2, j) -= torque.by_delay[j];
    force(kTangents - 1, j) -= torque.by_lag[j];
  }
  const MassMatrix M = m.Mass(angles.c2);
  Eigen::Matrix2d inverse;
  inverse << M.M22, -M.M12, -M.M12, M.M11;
  return force * (inverse / -M.det);
}

}  // namespace

Drive::Drive(double delay, double lag) : delay_(delay), lag_(std::max(lag, kShortestLag)) {}

void Drive::Add(double time, const Joints& command) {
  int cursor = static_cast<int>(times_.size()) - 1;
  DriveTangents tangents;
  starts_.push_back(At(time + delay_, cursor, &tangents));
  slopes_.push_back(tangents.by_lag);
  times_.push_back(time);
  commands_.push_back(command);
}

void Drive::Forget(double time) {
  const auto after = std::ranges::upper_bound(times_, time - delay_);
  const auto n = std::max<std::ptrdiff_t>(after - times_.begin() - 1, 0);
  times_.erase(times_.begin(), times_.begin() + n);
  for (auto* list : {&commands_, &starts_, &slopes_}) list->erase(list->begin(), list->begin() + n);
}

Drive Drive::Commanded(const MachineLog& log, const Twin& twin) {
  Drive drive(twin.actuator.delay, twin.actuator.lag);
  if (log.commanded.empty()) return drive;
  const Joints limit = TorqueLimits(twin, ActuatedJoint(log, twin));
  // The command of a row is sent while the angles of the next row are read.
  for (int row = 0; row + 1 < log.rows(); ++row) {
    Joints command = log.commanded[row];
    for (int j = 0; j < 2; ++j) {
      command[j] = std::clamp(command[j], -limit[j], limit[j]);
      if (!log.push.empty()) command[j] += log.push[row][j];
    }
    drive.Add(log.time[row + 1], command);
  }
  return drive;
}

Drive Drive::Measured(const MachineLog& log, const Twin& twin) {
  Drive drive(-twin.actuator.current_delay, 0);
  drive.times_ = log.time;
  drive.commands_ = log.measured;
  return drive;
}

int Drive::Find(double time, int& cursor) const {
  const int n = static_cast<int>(times_.size());
  // Mostly the same event as before, or the next one.
  if (cursor < n && times_[cursor] <= time) {
    while (cursor + 1 < n && times_[cursor + 1] <= time) ++cursor;
    return cursor;
  }
  const auto after = std::ranges::upper_bound(times_, time);
  const int found = static_cast<int>(after - times_.begin()) - 1;
  cursor = std::max(found, 0);
  return found;
}

Joints Drive::At(double time, int& cursor, DriveTangents* tangents) const {
  if (times_.empty()) return {};
  time -= delay_;
  const int event = Find(time, cursor);
  if (starts_.empty()) {
    if (event < 0) return commands_.front();
    if (event + 1 == static_cast<int>(times_.size())) return commands_.back();
    const double share = (time - times_[event]) / (times_[event + 1] - times_[event]);
    const Joints &a = commands_[event], &b = commands_[event + 1];
    return {a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])};
  }
  if (event < 0) return {};
  const double age = time - times_[event], decay = std::exp(-age / lag_);
  const Joints &command = commands_[event], &start = starts_[event];
  for (int j = 0; j < 2 && tangents != nullptr; ++j) {
    tangents->by_delay[j] = (start[j] - command[j]) * decay / lag_;
    tangents->by_lag[j] = slopes_[event][j] * decay + tangents->by_delay[j] * age / lag_;
  }
  return {command[0] + (start[0] - command[0]) * decay,
          command[1] + (start[1] - command[1]) * decay};
}

Manipulator BodyOf(const Twin& twin, bool reported) {
  Manipulator body = ManipulatorOf(twin.plant);
  if (reported) {
    body.J1 -= twin.actuator.current_inertia;
    body.a -= twin.actuator.current_inertia;
  }
  return body;
}

int MotionSteps(double seconds) {
  return std::max(1, static_cast<int>(std::ceil(seconds / kMotionStep - 1e-9)));
}

PendulumState StepMotion(const Manipulator& body, const Drive& drive, const PendulumState& now,
                         double time, double h, int& cursor, Joints& acceleration,
                         StepTangents* tangents) {
  DriveTangents half, full;
  const Joints u1 = drive.At(time + h / 2, cursor, tangents != nullptr ? &half : nullptr);
  const Joints u2 = drive.At(time + h, cursor, tangents != nullptr ? &full : nullptr);
  const auto acceleration_at = [&](const PendulumState& s, double share) {
    return body.Acceleration(s, share < 1 ? u1 : u2);
  };
  if (tangents == nullptr) {
    const PendulumState next = RungeKuttaStep(now, acceleration, h, acceleration_at);
    acceleration = body.Acceleration(next, u2);
    return next;
  }
  // The derivatives of each stage, as RungeKuttaStep makes it.
  const auto rate_of = [](const StepTangents& t) {
    StateTangents rate;
    rate << t.state.rightCols<2>(), t.acceleration;
    return rate;
  };
  StepTangents stage = *tangents;
  StateTangents sum = rate_of(stage);
  int stages = 1;
  const PendulumState next =
      RungeKuttaStep(now, acceleration, h, [&](const PendulumState& s, double share) {
        const Joints a = acceleration_at(s, share);
        stage.state = tangents->state + h * share * rate_of(stage);
        stage.acceleration = AccelerationTangents(body, s, a, share < 1 ? half : full, stage.state);
        sum += (++stages < 4 ? 2 : 1) * rate_of(stage);
        return a;
      });
  acceleration = body.Acceleration(next, u2);
  tangents->state += h / 6 * sum;
  tangents->acceleration = AccelerationTangents(body, next, acceleration, full, tangents->state);
  return next;
}

void Predict(const Manipulator& body, const Drive& drive, const Joints& zero,
             const PendulumState& start, const MachineLog& log, int first, int last,
             double acceleration_age, Motion& motion, MotionTangents* tangents) {
  const int rows = last - first;
  motion.angle.resize(rows);
  motion.velocity.resize(rows);
  motion.acceleration.resize(rows);
  if (tangents != nullptr) {
    tangents->angle.resize(kTangents, 2 * rows);
    tangents->acceleration.resize(kTangents, 2 * rows);
    tangents->jerk.resize(rows);
  }
  const double begin = log.time[first], end = log.time[last - 1];
  const int steps = MotionSteps(end - begin);
  const double h = std::max((end - begin) / steps, 1e-9);

  PendulumState now = start;
  now.q1 -= zero[0];
  now.q2 -= zero[1];
  int cursor = 0;
  DriveTangents of_torque;
  Joints k1 = body.Acceleration(now, drive.At(begin, cursor, &of_torque));
  StepTangents before, t;
  if (tangents != nullptr) {
    before.state.setIdentity();
    before.acceleration = AccelerationTangents(body, now, k1, of_torque, before.state);
  }
  int row = 0, late_row = 0;
  for (int step = 0; step < steps; ++step) {
    const double time = begin + step * h;
    Joints after = k1;
    if (tangents != nullptr) t = before;
    const PendulumState next =
        StepMotion(body, drive, now, time, h, cursor, after, tangents != nullptr ? &t : nullptr);

    const bool is_last = step + 1 == steps;
    for (; row < rows && (is_last || log.time[first + row] < time + h); ++row) {
      const double share = std::clamp((log.time[first + row] - time) / h, 0.0, 1.0);
      const PendulumState s = StateBetween(now, next, h, share);
      motion.angle[row] = {s.q1 + zero[0], s.q2 + zero[1]};
      motion.velocity[row] = {s.w1, s.w2};
      if (tangents == nullptr) continue;
      // The cubic of StateBetween.
      const double rest = 1 - share, a = rest * rest, b = share * share;
      tangents->angle.middleCols<2>(2 * row) =
          a * (1 + 2 * share) * before.state.leftCols<2>() +
          b * (1 + 2 * rest) * t.state.leftCols<2>() +
          h * share * rest * (rest * before.state.rightCols<2>() - share * t.state.rightCols<2>());
    }
    for (; late_row < rows; ++late_row) {
      const double moment = log.time[first + late_row] - acceleration_age;
      if (!is_last && moment >= time + h) break;
      const double share = std::clamp((moment - time) / h, 0.0, 1.0);
      for (int j = 0; j < 2; ++j) {
        motion.acceleration[late_row][j] = k1[j] + share * (after[j] - k1[j]);
        if (tangents != nullptr) tangents->jerk[late_row][j] = (after[j] - k1[j]) / h;
      }
      if (tangents == nullptr) continue;
      tangents->acceleration.middleCols<2>(2 * late_row) =
          (1 - share) * before.acceleration + share * t.acceleration;
    }
    now = next;
    k1 = after;
    if (tangents != nullptr) before = t;
  }
}

}  // namespace upswing::machine
