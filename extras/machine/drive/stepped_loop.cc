#include "extras/machine/drive/stepped_loop.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"

namespace upswing::machine {
namespace {

constexpr int64_t kTicks = 1'000'000;  // per second

SupervisorConfig SupervisorFor(const LoadedPolicy& policy, const Twin& twin,
                               const SteppedLoopConfig& config) {
  const Robot robot = RobotOf(policy);
  Joints motor{config.limits.passive_torque, config.limits.passive_torque};
  motor[MotorOf(robot)] = twin.plant.torque_limit;
  return {.limits = config.limits,
          .scale = ScaleOverUsual(twin.plant),
          .start = config.start,
          .motor_limit = motor,
          .actuated_joint = static_cast<int>(robot),
          .angle_range = twin.sensors.angle_range,
          .quantum = twin.sensors.quantum};
}

}  // namespace

SteppedLoopConfig SteppedLoopConfig::For(const Twin& twin) {
  SteppedLoopConfig config{.limits = Limits::For(twin)};
  config.limits.age = kLongestGap;
  return config;
}

void SteppedLoopConfig::Describe(Options& o) {
  limits.Describe(o);
  o.Add(&compensation, "compensation", kZeroToOne, "",
        "share of both joints' estimated dry friction that the motors compensate");
}

SteppedLoop::SteppedLoop(const MachinePolicy& policy, const Twin& twin,
                         const SteppedLoopConfig& config)
    : policy_(policy),
      latency_(config.latency),
      estimator_(twin, config.latency.value_or(0)),
      supervisor_(SupervisorFor(*policy, twin, config)),
      core_({.hz = kTicks,
             .seconds = INFINITY,
             .actuated_joint = static_cast<int>(RobotOf(*policy)),
             .compensation = config.compensation,
             .stop = [this] { return stop_asked_; }},
            estimator_, supervisor_, PerTick(), summary_) {
  // A first call of another controller touches memory that is not there yet.
  ControllerOf(policy)(0, {});
}

MachineController SteppedLoop::PerTick() {
  auto per_tick = [this, controller = ControllerOf(policy_), last = int64_t{-1}, torque = 0.0](
                      int64_t tick, const PendulumState& state) mutable {
    const double period = controller.period(), time = static_cast<double>(tick) / kTicks;
    // Readings seldom come exactly at the end of a control period: the nearest one counts.
    const double early = std::min(period_, period) / 2;
    const auto step = static_cast<int64_t>((time + early) / period);
    // After a gap only the last of the missed actions is made up.
    if (step > last) {
      torque = controller(step, state);
      last = step;
    }
    return torque;
  };
  return {std::move(per_tick), 1.0 / kTicks};
}

void SteppedLoop::CheckReading(double time, const Joints& angle) const {
  if (!std::isfinite(time)) {
    throw BadInput(Concat("t: expected a finite time in s, got ", FormatNumber(time)));
  }
  if (begun_ && time < time_) {
    throw BadInput(Concat("t: expected ", FormatNumber(time_), " s or later, got ",
                          FormatNumber(time), ": the clock of a machine never goes back"));
  }
  for (const double q : angle) {
    if (std::isfinite(q)) continue;
    throw BadInput(Concat("q: expected two finite angles in rad, got ", FormatNumber(angle[0]),
                          " and ", FormatNumber(angle[1])));
  }
}

void SteppedLoop::LearnPeriod(double interval) {
  intervals_[known_intervals_ % intervals_.size()] = interval;
  ++known_intervals_;
  std::array<double, 15> sorted = intervals_;
  const size_t count = std::min(known_intervals_, sorted.size());
  const auto median = sorted.begin() + static_cast<std::ptrdiff_t>((count - 1) / 2);
  std::nth_element(sorted.begin(), median, sorted.begin() + static_cast<std::ptrdiff_t>(count));
  period_ = *median;
}

void SteppedLoop::Cycle(double now, const Joints& angle) {
  core_.CheckAge(now, 0);
  estimator_.SetTimes(period_, latency_.value_or(period_));
  if (!latency_) estimator_.Send(now, core_.torque());
  const LinkReading reading{{{angle, {}}, now}, now, /*locked=*/false};
  const CycleTimes times{.number = std::llround(now * kTicks), .now = now, .period = period_};
  core_.Decide(times, reading);
  if (latency_) estimator_.Send(now + *latency_, core_.torque());
}

Joints SteppedLoop::Step(double time, const Joints& angle) {
  if (!refused_.empty()) return {};
  try {
    CheckReading(time, angle);
    if (begun_ && time == time_) return core_.torque();
    // A clock that began long ago, or below 0, counts from the first reading.
    constexpr double kLongAgo = 1e5;  // s
    if (!begun_) origin_ = time < 0 || time > kLongAgo ? time : 0;
    if (begun_) LearnPeriod(time - time_);
    begun_ = true;
    time_ = time;
    ++summary_.cycles;
    Cycle(time - origin_, angle);
  } catch (const std::exception& error) {
    refused_ = error.what();
    throw;
  }
  return core_.torque();
}

std::string SteppedLoop::stopped() const {
  if (!refused_.empty()) return refused_;
  if (!supervisor_.reason().empty()) return supervisor_.reason();
  const bool stops = supervisor_.ended() || supervisor_.state() == LoopState::kBraking;
  return stops ? "the caller asked for a stop" : "";
}

}  // namespace upswing::machine
