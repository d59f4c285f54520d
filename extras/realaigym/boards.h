#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "agents/loaded_policy.h"
#include "base/progress.h"
#include "base/sample.h"
#include "extras/machine/controller.h"
#include "extras/machine/twin.h"
#include "extras/realaigym/search.h"
#include "extras/realaigym/uptime.h"
#include "runs/find_policy.h"

/// Scoring of policies by the rules of RealAIGym's boards (docs/howto/realaigym.md).
namespace upswing::realaigym {

/// A competitor on the board: a policy found by a search, any policy of the double pendulum, or the
/// benchmark's own linear regulator.
struct Competitor {
  std::string name;
  Robot robot = Robot::kPendubot;
  BoardControllerMaker make;
  std::string plant = {};  // plant of its design; empty: the board's
  int period = 1;          // steps of kBoardTimestep from one action to the next
};

/// The competitor's controller of one machine.
std::unique_ptr<MachineController> MachineControllerOf(const Competitor& competitor);

/// Steps of the board in a control period of the task, 20 ms.
inline constexpr int kPolicyPeriod = static_cast<int>(kControlPeriod / kBoardTimestep + 0.5);

/// Controls `count` simulations with a policy of the double pendulum. It acts every 20 ms, on
/// PendulumEnv's observations of the policy's design plant. `loaded` must outlive it.
std::unique_ptr<BoardController> ControllerOf(const LoadedPolicy& loaded, size_t count);

/// The name of the benchmark's regulator, which holds upright but does not swing up.
inline constexpr const char* kBoardRegulator = "baseline-lqr";

/// The competitor that the arguments name, for this robot ("": the policy's own robot, a
/// controller's that of the twin). With `twin`, a controller is designed for its plant without dry
/// friction: the motors compensate most of it, and a linear model has none. Throws BadInput.
Competitor GetCompetitor(PolicyArguments a, const std::string& robot,
                         const std::optional<Twin>& twin = {});

/// Loads a policy that a search wrote. Throws BadInput.
SwingPolicy LoadSwingPolicy(const std::filesystem::path& path);

/// The competitor with a search's current policy.
Competitor CompetitorOf(const BoardSearch& search, const std::string& name);

/// An entry of the board, published or our own.
struct BoardEntry {
  std::string name;
  double seconds, energy, torque_cost, smoothness, velocity_cost, performance;
  std::array<double, kRobustnessRows> rows;  // shares; NaN: unknown
  double robustness;
};

/// The published entries of the simulation boards, version 2, best performance first.
std::vector<BoardEntry> PublishedEntries(Robot robot);

/// A published entry of a hardware board, version 2. The measures are those of its best run.
struct HardwareEntry {
  std::string name;
  int successes;  // of ten runs
  double seconds, energy, torque_cost, smoothness, velocity_cost;
  double best, mean;  // scores of ten runs; a failure counts 0
};

/// The published entries of the hardware boards, version 2, best mean first. Entries with pushes
/// were scored with HardwareScales.
std::vector<HardwareEntry> PublishedHardwareEntries(Robot robot, bool pushed);

/// A competitor's scores.
struct BoardReport {
  Competitor competitor;
  BoardOutcome nominal;
  Robustness robustness;
  std::vector<BoardSample> trace;  // of the nominal simulation
  double seconds;                  // wall time of the simulations
  BoardEntry Entry() const;
};

/// Runs all simulations of the board's scores. `progress` counts them.
BoardReport ScoreOnBoard(const Competitor& competitor, uint64_t seed, ThreadPool& pool,
                         const Progress& progress);

/// A published entry of the boards of ICRA 2025, score version 3: a single run.
struct UptimeEntry {
  std::string name;
  double score;
  int swing_ups;
};
/// These entries, best first.
std::vector<UptimeEntry> PublishedUptimes(Robot robot);

/// A competitor's runs by score version 3.
struct UptimeReport {
  Competitor competitor;
  std::vector<UptimeRun> runs;
  Moments scores;
  std::vector<BoardSample> trace;  // of the first run
  double seconds;                  // wall time of the simulations
  Interval interval() const;       // 95%, of the mean score (normal approximation)
};

/// Simulates `count` runs, whose resets have seeds from `seed` on. `progress` counts them.
UptimeReport ScoreUptime(const Competitor& competitor, uint64_t seed, int count, ThreadPool& pool,
                         const Progress& progress);

std::string UptimeJson(const UptimeReport& report);
std::string BoardJson(const BoardReport& report);
/// A motion as CSV in the boards' own format.
std::string BoardCsv(std::span<const BoardSample> trace);
/// Draws the six rows of robustness as .svg or .png.
void DrawBoard(const BoardReport& report, const std::filesystem::path& file);

}  // namespace upswing::realaigym
