#include "realaigym/machine_trials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>

#include "machine/motion.h"

namespace upswing {
namespace {

/// Subtracts the compensation of a twin's dry friction from a machine's dry friction.
void Compensate(const Twin& twin, Manipulator& body) {
  body.f1 -= kCompensated * twin.plant.coulomb1;
  body.f2 -= kCompensated * twin.plant.coulomb2;
}

/// Motors, encoders and loop of a machine in the terms of the boards' simulation.
BoardEpisode EpisodeOf(const Twin& machine, const Twin& compensated) {
  BoardEpisode episode;
  episode.body = BodyOf(machine);
  Compensate(compensated, *episode.body);
  episode.quantum = machine.sensors.quantum;
  episode.response = 1 - std::exp(-kBoardTimestep / std::max(machine.actuator.lag, 1e-5));
  const double age = machine.loop.period + machine.actuator.delay;
  episode.delay = std::clamp(static_cast<int>(std::lround(age / kBoardTimestep)), 0, 20);
  return episode;
}

/// Two Gaussian pulses of torque at each joint, at least a second apart.
std::function<Joints(double)> HardwarePushes(Rng& rng) {
  struct Pulse {
    int joint;
    double amplitude, time, width;
  };
  std::array<Pulse, 4> pulses{};
  double time = 0;
  for (int k = 0; k < 4; ++k) {
    time += 1 + rng.Uniform(0, 1.4);
    const double sign = rng.Uniform() < 0.5 ? -1 : 1;
    pulses[k] = {k % 2, sign * rng.Uniform(0.2, 0.5), time, rng.Uniform(0.05, 0.1)};
  }
  return [pulses](double now) {
    Joints torque{};
    for (const Pulse& p : pulses) {
      const double z = (now - p.time) / p.width;
      torque[p.joint] += p.amplitude * std::exp(-z * z / 2);
    }
    return torque;
  };
}

/// State of a controller made by OnMachine.
struct BoardOnMachine {
  std::unique_ptr<BoardController> controller;
  BoardMeasurement measured{};
  Lanes torque{};        // N·m
  double last_time = 0;  // of the cycle before, s
  Joints last_angle{};   // in the cycle before, rad
  int steps = 0;         // steps of the controller so far
};

}  // namespace

Joints CompensationAt(const Twin& twin, const Joints& velocity) {
  const auto of = [&](double coulomb, double w) {
    return kCompensated * coulomb * std::atan(kFrictionSlope * w);
  };
  return {of(twin.plant.coulomb1, velocity[0]), of(twin.plant.coulomb2, velocity[1])};
}

BoardEpisode NominalEpisode(const Twin& twin) { return EpisodeOf(twin, twin); }

BoardEpisode DrawEpisode(const Twin& twin, Rng& rng) {
  const Twin machine = DrawTwin(twin, rng);
  BoardEpisode episode = EpisodeOf(machine, twin);
  episode.delay = std::clamp(episode.delay + static_cast<int>(rng.Below(2)), 0, 20);
  episode.zero = {machine.sensors.zero1 - twin.sensors.zero1,
                  machine.sensors.zero2 - twin.sensors.zero2};
  double time = 0;
  bool passive = rng.Uniform() < 0.5;
  for (BoardPush& push : episode.pushes) {
    time += rng.Uniform(0.5, 2.5);
    push = {rng.Uniform(-0.6, 0.6), time, rng.Uniform(0.05, 0.1), passive};
    passive = !passive;
  }
  episode.seed = rng.Next();
  return episode;
}

TrialController OnMachine(const BoardControllerMaker& make, const Twin& twin, Robot robot) {
  return [make, twin, robot]() -> CycleController {
    auto own = std::make_shared<BoardOnMachine>();
    own->controller = make(0);
    return [own, twin, robot](const CycleInput& in) -> Joints {
      const Joints angle{in.angle[0] - twin.sensors.zero1, in.angle[1] - twin.sensors.zero2};
      // The controller acts at the points of its even grid since the last cycle.
      const double since = std::max(in.time - own->last_time, 1e-9);
      for (; own->steps * kBoardTimestep <= in.time; ++own->steps) {
        const double share =
            std::clamp((own->steps * kBoardTimestep - own->last_time) / since, 0.0, 1.0);
        const auto at = [&](int j) {
          return own->steps == 0 ? angle[j]
                                 : own->last_angle[j] + share * (angle[j] - own->last_angle[j]);
        };
        own->measured.q1[0] = at(0);
        own->measured.q2[0] = at(1);
        own->measured.w1[0] = in.velocity[0];
        own->measured.w2[0] = in.velocity[1];
        own->controller->Act(own->steps, own->measured, 1, own->torque);
      }
      own->last_time = in.time;
      own->last_angle = angle;
      Joints torque = CompensationAt(twin, in.velocity);
      torque[robot == Robot::kPendubot ? 0 : 1] += own->torque[0];
      return torque;
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
    run.largest_velocity = rules.largest_velocity;
    if (rules.pushes) run.push = rules.push_of ? rules.push_of(i) : HardwarePushes(rng);
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

}  // namespace upswing
