#include "extras/machine/motion.h"

#include <algorithm>
#include <cmath>

#include "pendulum/runge_kutta.h"

namespace upswing::machine {
namespace {

constexpr double kShortestLag = 1e-5;  // s; shorter lags count as this one

}  // namespace

Drive::Drive(double delay, double lag) : delay_(delay), lag_(std::max(lag, kShortestLag)) {}

void Drive::Add(double time, const Joints& command) {
  int cursor = static_cast<int>(times_.size()) - 1;
  starts_.push_back(At(time + delay_, cursor));
  times_.push_back(time);
  commands_.push_back(command);
}

void Drive::Forget(double time) {
  const auto after = std::ranges::upper_bound(times_, time - delay_);
  const auto n = std::max<std::ptrdiff_t>(after - times_.begin() - 1, 0);
  times_.erase(times_.begin(), times_.begin() + n);
  commands_.erase(commands_.begin(), commands_.begin() + n);
  starts_.erase(starts_.begin(), starts_.begin() + n);
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

Joints Drive::At(double time, int& cursor) const {
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
  const double decay = std::exp(-(time - times_[event]) / lag_);
  const Joints &command = commands_[event], &start = starts_[event];
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
                         double time, double h, int& cursor, Joints& acceleration) {
  const Joints u1 = drive.At(time + h / 2, cursor), u2 = drive.At(time + h, cursor);
  const PendulumState next =
      RungeKuttaStep(now, acceleration, h, [&](const PendulumState& s, double share) {
        return body.Acceleration(s, share < 1 ? u1 : u2);
      });
  acceleration = body.Acceleration(next, u2);
  return next;
}

void Predict(const Manipulator& body, const Drive& drive, const Joints& zero,
             const PendulumState& start, const MachineLog& log, int first, int last,
             double acceleration_age, Motion& motion) {
  const int rows = last - first;
  motion.angle.resize(rows);
  motion.velocity.resize(rows);
  motion.acceleration.resize(rows);
  const double begin = log.time[first], end = log.time[last - 1];
  const int steps = MotionSteps(end - begin);
  const double h = std::max((end - begin) / steps, 1e-9);

  PendulumState now = start;
  now.q1 -= zero[0];
  now.q2 -= zero[1];
  int cursor = 0;
  Joints k1 = body.Acceleration(now, drive.At(begin, cursor));
  int row = 0, late_row = 0;
  for (int step = 0; step < steps; ++step) {
    const double time = begin + step * h;
    Joints after = k1;
    const PendulumState next = StepMotion(body, drive, now, time, h, cursor, after);

    const bool is_last = step + 1 == steps;
    for (; row < rows && (is_last || log.time[first + row] < time + h); ++row) {
      const double share = std::clamp((log.time[first + row] - time) / h, 0.0, 1.0);
      const PendulumState s = StateBetween(now, next, h, share);
      motion.angle[row] = {s.q1 + zero[0], s.q2 + zero[1]};
      motion.velocity[row] = {s.w1, s.w2};
    }
    for (; late_row < rows; ++late_row) {
      const double moment = log.time[first + late_row] - acceleration_age;
      if (!is_last && moment >= time + h) break;
      const double share = std::clamp((moment - time) / h, 0.0, 1.0);
      for (int j = 0; j < 2; ++j) {
        motion.acceleration[late_row][j] = k1[j] + share * (after[j] - k1[j]);
      }
    }
    now = next;
    k1 = after;
  }
}

}  // namespace upswing::machine
