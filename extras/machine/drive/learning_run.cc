#include "extras/machine/drive/learning_run.h"

#include <future>
#include <utility>

namespace upswing::machine {

RunOutcome RunCycles(const LearnConfig& c, const RunRules& rules, const MachineSensors& sensors,
                     Estimator estimator, MachineController own, MachineLink& link,
                     const std::function<bool()>& stop) {
  const int64_t hz = std::llround(c.hz);
  Joints motor{c.limits.passive_torque, c.limits.passive_torque};
  motor[c.actuated_joint - 1] = c.limits.torque;
  Supervisor supervisor({.limits = rules.limits,
                         .scale = rules.scale,
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
  constexpr double kMostTurn = 7.5;  // of a joint in a try, rad
  const LoopSummary* summary = nullptr;
  PendulumState first;
  double upright_at = 0;  // s
  config.stop = [&] {
    const PendulumState& s = estimator.now();
    if (summary->driven == 0) first = s;
    if (summary->upright > 0) upright_at = summary->driven;
    const bool lost = summary->driven - upright_at > kLongestFall * rules.scale.time ||
                      LargerMagnitude(s.q1 - first.q1, s.q2 - first.q2) > kMostTurn;
    return stop() || (rules.is_try && (lost || summary->upright >= c.hold));
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
  return {loop.summary(), static_cast<double>(summary->moving) / c.hz, supervisor.reason(),
          supervisor.faulty()};
}

}  // namespace upswing::machine
