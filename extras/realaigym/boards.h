#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "agents/loaded_policy.h"
#include "base/sample.h"
#include "extras/machine/controller.h"
#include "extras/machine/twin.h"
#include "extras/realaigym/simulation.h"
#include "extras/realaigym/uptime.h"
#include "runs/find_policy.h"

/// Scoring of policies by the rules of RealAIGym's boards (docs/howto/realaigym.md).
namespace upswing::realaigym {

/// A policy of the double pendulum on the boards.
struct Competitor {
  std::shared_ptr<const LoadedPolicy> loaded;
  Robot robot = Robot::kPendubot;
  std::string plant = {};  // plant of its design; empty: the board's

  const std::string& name() const { return loaded->name; }
};

/// The robot with this name; nothing for "". Throws BadInput.
std::optional<Robot> ParseRobot(const std::string& name);

/// The competitor that the arguments name, for this robot ("": the policy's own robot, a
/// controller's that of the twin). With `twin`, a controller is designed for its plant without dry
/// friction: the motors compensate most of it, and a linear model has none. Throws BadInput.
Competitor GetCompetitor(PolicyArguments a, const std::string& robot,
                         const std::optional<Twin>& twin = {});

/// A policy as the controller of one machine. It acts every 20 ms, on PendulumEnv's observations of
/// the policy's design plant.
std::unique_ptr<MachineController> MachineControllerOf(std::shared_ptr<const LoadedPolicy> loaded);
/// Makes controllers of the competitor's motor. A controller's first call is its first step.
ControllerMaker ControllersOf(const Competitor& competitor);

/// A competitor's scores, version 2.
struct BoardReport {
  Competitor competitor;
  BoardOutcome nominal;
  Robustness robustness;
};
/// The nominal simulation.
MachineLog NominalLog(const Competitor& competitor);
/// Runs all simulations of the scores. `progress` counts those of robustness.
BoardReport ScoreOnBoard(const Competitor& competitor, uint64_t seed, ThreadPool& pool,
                         const Progress& progress);
std::string BoardJson(const BoardReport& report);

/// A competitor's scores, version 3.
struct UptimeReport {
  Competitor competitor;
  std::vector<UptimeRun> runs;

  Moments scores() const;
  Interval interval() const;  // 95%, of the mean score (normal approximation)
};
/// Simulates `count` runs, whose resets have seeds from `seed` on. `progress` counts them.
UptimeReport ScoreUptime(const Competitor& competitor, uint64_t seed, int count, ThreadPool& pool,
                         const Progress& progress);
/// The first of these runs.
MachineLog UptimeLog(const Competitor& competitor, uint64_t seed);
std::string UptimeJson(const UptimeReport& report);

/// A motion as CSV in the boards' own format.
std::string BoardCsv(const MachineLog& log);

}  // namespace upswing::realaigym
