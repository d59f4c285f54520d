#include "extras/realaigym/machine_trials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>

#include "extras/machine/estimator.h"
#include "extras/machine/motion.h"

namespace upswing::realaigym {
namespace {

/// Two Gaussian pulses of torque at each joint, at least a second apart, the first at joint 1.
std::array<BoardPush, 4> HardwarePushes(Robot robot, Rng& rng) {
  std::array<BoardPush, 4> pushes;
  bool passive = robot == Robot::kAcrobot;
  double time = 0;
  for (BoardPush& push : pushes) {
    time += 1 + rng.Uniform(0, 1.4);
    const double sign = rng.Uniform() < 0.5 ? -1 : 1;
    push = {sign * rng.Uniform(0.2, 0.5), time, rng.Uniform(0.05, 0.1), passive};
    passive = !passive;
  }
  return pushes;
}

/// The torques (N·m) of pushes at both joints over time (s).
std::function<Joints(double)> PushTorques(const std::array<BoardPush, 4>& pushes, Robot robot) {
  return [pushes, robot](double now) {
    const size_t motor = static_cast<size_t>(robot) - 1;
    Joints torque{};
    for (const BoardPush& push : pushes) {
      torque[push.passive ? 1 - motor : motor] += push.Torque(now);
    }
    return torque;
  };
}

/// State of a controller made by OnMachine.
struct BoardOnMachine {
  Estimator estimator;
  std::unique_ptr<BoardController> controller;
  BoardMeasurement measured{};
  Lanes torque{};  // N·m
  Joints sent{};   // in the last cycle, N·m
  int steps = 0;   // of the controller so far
};

}  // namespace

BoardEpisode EpisodeOf(const Twin& machine) {
  BoardEpisode episode;
  episode.body = BodyOf(machine);
  episode.body->f1 *= 1 - kCompensated;
  episode.body->f2 *= 1 - kCompensated;
  episode.angle_range = machine.sensors.angle_range;
  episode.response = 1 - std::exp(-kBoardTimestep / std::max(machine.actuator.lag, 1e-5));
  return episode;
}

BoardEpisode DrawEpisode(const Twin& twin, Robot robot, Rng& rng) {
  const Twin machine = DrawTwin(twin, rng);
  BoardEpisode episode = EpisodeOf(machine);
  const double left = rng.Uniform(0, 1.5);
  episode.zero = {left * (machine.sensors.zero1 - twin.sensors.zero1),
                  left * (machine.sensors.zero2 - twin.sensors.zero2)};
  episode.delay = static_cast<int>(rng.Below(2));
  episode.pushes = HardwarePushes(robot, rng);
  episode.seed = rng.Next();
  return episode;
}

TrialController OnMachine(const BoardControllerMaker& make, const Twin& twin, Robot robot) {
  return [make, twin, robot]() -> CycleController {
    auto own = std::make_shared<BoardOnMachine>(
        BoardOnMachine{Estimator(twin, twin.loop.period), make(0)});
    const Joints limit = TorqueLimits(twin, static_cast<int>(robot));
    return [own, limit, robot](const CycleInput& in) -> Joints {
      const TimedReading reading{{in.angle, {}}, in.time};
      own->estimator.Update(in.time, own->sent, &reading);
      own->measured.SetFirst(own->estimator.ahead(), own->estimator.has_twin());
      // A controller that holds its torque counts the steps.
      for (; own->steps * kBoardTimestep <= in.time; ++own->steps) {
        own->controller->Act(own->steps, own->measured, 1, own->torque);
      }
      Joints torque = own->estimator.CompensationTorque(kCompensated);
      torque[static_cast<size_t>(robot) - 1] += own->torque[0];
      for (size_t j = 0; j < 2; ++j) torque[j] = std::clamp(torque[j], -limit[j], limit[j]);
      return own->sent = torque;
    };
  };
}

HardwareReport RunTrials(const Twin& twin, Robot robot, const TrialController& make,
                         const TrialRules& rules, ThreadPool* pool, const Progress& progress) {
  std::vector<HardwareRun> runs(static_cast<size_t>(rules.count));
  std::mutex mutex;
  double done = 0;
  ParallelFor(pool, rules.count, [&](int i) {
    Rng rng(rules.seed, "realaigym: machine", static_cast<uint64_t>(i));
    const Twin machine = DrawTwin(twin, rng);
    LoopRun run;
    run.seconds = kBoardSteps * kBoardTimestep;
    run.actuated_joint = static_cast<int>(robot);
    run.largest_angle = machine.sensors.angle_range;
    run.largest_velocity = rules.largest_velocity;
    if (rules.pushes) {
      run.push = rules.push_of ? rules.push_of(i) : PushTorques(HardwarePushes(robot, rng), robot);
    }
    run.seed = rng.Next();
    const MachineLog log = RunLoop(machine, run, make());
    runs[static_cast<size_t>(i)] = ScoreHardware(std::span(&log, 1), robot).runs.front();
    runs[static_cast<size_t>(i)].name = "draw " + std::to_string(i + 1);
    if (!progress) return;
    const std::lock_guard lock(mutex);
    progress(++done, rules.count);
  });
  return {robot, rules.pushes, std::move(runs)};
}

}  // namespace upswing::realaigym
