#include "extras/realaigym/machine_trials.h"

#include <algorithm>
#include <array>
#include <memory>
#include <numbers>

#include "base/rng.h"
#include "base/text.h"
#include "extras/machine/drive/estimator.h"

namespace upswing::realaigym {
namespace {

/// Four Gaussian pulses of torque, the first at joint 1, then at the joints in turn, at least a
/// second apart. Returns the torques (N·m) over time (s).
std::function<Joints(double)> RandomPushTorques(Rng& rng) {
  std::array<BoardPush, 4> pushes;
  double time = 0;
  for (BoardPush& push : pushes) {
    time += 1 + rng.Uniform(0, 1.4);
    const double sign = rng.Uniform() < 0.5 ? -1 : 1;
    push = {sign * rng.Uniform(0.2, 0.5), time, rng.Uniform(0.05, 0.1)};
  }
  return [pushes](double now) {
    Joints torque{};
    for (size_t k = 0; k < pushes.size(); ++k) torque[k % 2] += pushes[k].Torque(now);
    return torque;
  };
}

/// Runs a controller on the machine of a trial. `run` has the rules, and gets the trial's pushes
/// if `pushes` asks for them.
MachineLog RunTrial(const Twin& twin, int trial, LoopRun run, const TrialRules& rules, bool pushes,
                    const TrialController& make) {
  Rng rng(rules.seed, "realaigym: machine", static_cast<uint64_t>(trial));
  const Twin machine = DrawTwin(twin, rng);
  run.largest_angle = std::min(run.largest_angle, machine.sensors.angle_range);
  if (pushes) run.push = rules.push_of ? rules.push_of(trial) : RandomPushTorques(rng);
  run.seed = rng.Next();
  return RunLoop(machine, run, make(run.seed));
}

}  // namespace

TrialController OnMachine(const ControllerMaker& make, const Twin& twin, Robot robot,
                          const std::optional<ResetRules>& resets) {
  return [make, twin, robot, resets](uint64_t seed) -> CycleController {
    const auto estimator = std::make_shared<Estimator>(twin, twin.loop.period);
    const Joints limit = TorqueLimits(twin, static_cast<int>(robot));
    const ControllerMaker compensated = [make, estimator, limit]() -> CycleController {
      return [own = make(), estimator, limit](const CycleInput& in) -> Joints {
        Joints torque = own(in);
        const Joints friction = estimator->CompensationTorque(kCompensated);
        for (size_t j = 0; j < 2; ++j) {
          torque[j] = std::clamp(torque[j] + friction[j], -limit[j], limit[j]);
        }
        return torque;
      };
    };
    const CycleController driver = resets ? WithResets(compensated, *resets, seed) : compensated();
    return [estimator, driver, sent = Joints{}](const CycleInput& in) mutable -> Joints {
      const TimedReading reading{{in.angle, {}}, in.time};
      estimator->Update(in.time, sent, &reading);
      const PendulumState& s = estimator->ahead();
      sent = driver({in.time, {s.q1, s.q2}, {s.w1, s.w2}});
      return sent;
    };
  };
}

HardwareReport RunTrials(const Twin& twin, Robot robot, const TrialController& make,
                         const TrialRules& rules, ThreadPool* pool, const Progress& progress) {
  const LoopRun run{.seconds = kBoardSeconds,
                    .largest_velocity = rules.largest_velocity,
                    .actuated_joint = static_cast<int>(robot)};
  const auto score = [&](int i) {
    const MachineLog log = RunTrial(twin, i, run, rules, rules.pushes, make);
    HardwareRun own = ScoreHardware(std::span(&log, 1), robot).runs.front();
    own.name = Concat("draw ", i + 1);
    return own;
  };
  return {robot, rules.pushes, RunAll(rules.count, pool, progress, score)};
}

std::vector<UptimeRun> RunUptimeTrials(const Twin& twin, const TrialController& make,
                                       const TrialRules& rules, ThreadPool* pool,
                                       const Progress& progress) {
  // Both motors may make a reset. These are the machine's safety limits.
  const LoopRun run{
      .seconds = kUptimeSeconds, .largest_angle = 4 * std::numbers::pi, .largest_velocity = 25};
  return RunAll(rules.count, pool, progress,
                [&](int i) { return UptimeOf(RunTrial(twin, i, run, rules, false, make)); });
}

}  // namespace upswing::realaigym
