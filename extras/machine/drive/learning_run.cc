#include "extras/machine/drive/learning_run.h"

#include <algorithm>
#include <future>
#include <utility>

#include "extras/machine/drive/real_time.h"

namespace upswing::machine {

namespace {

/// Ends a run: a try that has balanced or is lost, and any run before its time of motion is over.
class RunEnd {
 public:
  RunEnd(const RunRules& rules, double hold, double hz) : rules_(rules), hold_(hold), hz_(hz) {}

  /// The longest time for which both links were inverted so far, s.
  double balanced() const { return balanced_; }

  /// Whether the run ends in a cycle with this state and these results so far.
  bool IsNow(const PendulumState& s, const LoopSummary& summary) {
    balanced_ = std::max(balanced_, summary.upright);
    // The brake begins in the next cycle.
    const double moved = static_cast<double>(summary.moving + 1) / hz_;
    if (moved >= rules_.motion - BrakeReserve(rules_)) return true;
    return rules_.is_try && (IsLost(s, summary) || summary.upright >= hold_);
  }

 private:
  bool IsLost(const PendulumState& s, const LoopSummary& summary) {
    constexpr double kMostTurn = 7.5;  // of a joint in a try, rad
    if (summary.driven == 0) first_ = s;
    if (summary.upright > 0) upright_at_ = summary.driven;
    return summary.driven - upright_at_ > kLongestFall * rules_.scale.time ||
           LargerMagnitude(s.q1 - first_.q1, s.q2 - first_.q2) > kMostTurn;
  }

  const RunRules& rules_;
  double hold_, hz_;
  double balanced_ = 0;
  PendulumState first_;
  double upright_at_ = 0;  // s
};

}  // namespace

double BrakeReserve(const RunRules& rules) {
  return std::min(rules.limits.brake_seconds, rules.motion / 2);
}

RunOutcome RunCycles(const LearnConfig& c, const RunRules& rules, const MachineSensors& sensors,
                     Estimator estimator, MachineController own, MachineLink& link,
                     const std::function<bool()>& stop) {
  const int64_t hz = std::llround(c.hz);
  Joints motor{c.limits.passive_torque, c.limits.passive_torque};
  motor[c.actuated_joint - 1] = c.limits.torque;
  Limits limits = rules.limits;
  limits.brake_seconds = BrakeReserve(rules);
  Supervisor supervisor({.limits = limits,
                         .scale = rules.scale,
                         .start_angle = rules.start_angle,
                         .motor_limit = motor,
                         .actuated_joint = c.actuated_joint,
                         // Excitations make the twin that predicts the motion of a try.
                         .trust = rules.is_try ? TwinTrust::kInRun : TwinTrust::kNever,
                         .angle_range = sensors.angle_range,
                         .quantum = sensors.quantum});
  LoopConfig config{.hz = hz,
                    .seconds = rules.seconds,
                    .actuated_joint = c.actuated_joint,
                    .compensation = rules.compensation};
  const LoopSummary* summary = nullptr;
  RunEnd end(rules, c.hold, c.hz);
  config.stop = [&] {
    const bool ends = end.IsNow(estimator.now(), *summary);
    return stop() || ends;
  };
  LogWriter log(rules.log);
  ControlLoop loop(config, link, estimator, supervisor, std::move(own), log);
  summary = &loop.summary();
  const auto run = [&] {
    if (!link.simulated()) EnterRealTime();
    loop.Run();
  };
  std::async(std::launch::async, run).get();
  log.Finish();
  return {.summary = loop.summary(),
          .motion = static_cast<double>(summary->moving) / c.hz,
          .balanced = end.balanced(),
          .reason = supervisor.reason(),
          .faulty = supervisor.faulty()};
}

}  // namespace upswing::machine
