#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "realaigym/search.h"
#include "run/find_policy.h"
#include "setup/loaded_policy.h"

/// RealAIGym's boards (docs/howto/realaigym.md): scoring any policy by their rules.
namespace upswing {

/// What competes: a policy found by a search, any policy of the double pendulum, or the
/// benchmark's own linear regulator.
struct Competitor {
  std::string name;
  Robot robot = Robot::kPendubot;
  BoardControllerMaker make;
  std::string plant = {};  // that it was made for; empty: the board's
};

/// Acts with a policy of the double pendulum in so many simulations: each 20 ms, on observations as
/// PendulumEnv makes them of the plant that the policy was made for. `loaded` outlives it.
std::unique_ptr<BoardController> ControllerOf(const LoadedPolicy& loaded, size_t count);

/// The name of the benchmark's regulator, which holds and does not swing up.
inline constexpr const char* kBoardRegulator = "baseline-lqr";

/// The competitor that the arguments name, for this robot ("" : the policy's own). Throws BadInput.
Competitor GetCompetitor(const PolicyArguments& a, const std::string& robot);

/// A policy that a search wrote. Throws BadInput.
SwingPolicy LoadSwingPolicy(const std::filesystem::path& path);

/// The competitor of a search as it stands.
Competitor CompetitorOf(const BoardSearch& search, const std::string& name);

/// An entry of the board, or ours.
struct BoardEntry {
  std::string name;
  double seconds, energy, torque_cost, smoothness, velocity_cost, performance;
  std::array<double, kRobustnessRows> rows;  // shares; NaN: unknown
  double robustness;
};

/// The published entries of the simulation boards, version 2, best performance first.
std::vector<BoardEntry> PublishedEntries(Robot robot);

/// A competitor's scores.
struct BoardReport {
  Competitor competitor;
  BoardOutcome nominal;
  Robustness robustness;
  std::vector<BoardSample> trace;  // of the nominal simulation
  double seconds;                  // that the simulations took
  BoardEntry Entry() const;
};

/// Makes all simulations. `progress` counts them.
BoardReport ScoreOnBoard(const Competitor& competitor, uint64_t seed, ThreadPool& pool,
                         const Progress& progress);

std::string BoardJson(const BoardReport& report);
/// The nominal motion in the boards' own format.
std::string BoardCsv(const BoardReport& report);
/// The six rows of robustness, as .svg or .png.
void DrawBoard(const BoardReport& report, const std::filesystem::path& file);

}  // namespace upswing
