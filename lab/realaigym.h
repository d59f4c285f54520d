#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "lab/loaded_policy.h"
#include "realaigym/search.h"

/// RealAIGym's boards (docs/realaigym.md): scoring any policy by their rules.
namespace upswing {

/// What competes: a policy found by a search, any policy of the double pendulum, or the
/// benchmark's own linear regulator.
struct GymCompetitor {
  std::string name;
  GymRobot robot = GymRobot::kPendubot;
  GymControllerMaker make;
};

/// Acts with a policy of the double pendulum in so many simulations: each 20 ms, on observations as
/// PendulumEnv makes them of the plant that the policy was made for. `loaded` outlives it.
std::unique_ptr<GymController> ControllerOf(const LoadedPolicy& loaded, size_t count);

/// The name of the benchmark's regulator, which holds and does not swing up.
inline constexpr const char* kGymRegulator = "baseline-lqr";

/// The competitor that the arguments name, for this robot ("" : the policy's own). Throws BadInput.
GymCompetitor GetGymCompetitor(const PolicyArguments& a, const std::string& robot);

/// A policy that a search wrote. Throws BadInput.
SwingPolicy LoadSwingPolicy(const std::filesystem::path& path);

/// The competitor of a search as it stands.
GymCompetitor CompetitorOf(const GymSearch& search, const std::string& name);

/// An entry of the board, or ours.
struct GymEntry {
  std::string name;
  double seconds, energy, torque_cost, smoothness, velocity_cost, performance;
  std::array<double, kGymRows> rows;  // shares; NaN: unknown
  double robustness;
};

/// The published entries of the simulation boards, version 2, best performance first.
std::vector<GymEntry> PublishedGymEntries(GymRobot robot);

/// A competitor's scores.
struct GymReport {
  GymCompetitor competitor;
  GymOutcome nominal;
  GymRobustness robustness;
  std::vector<GymSample> trace;  // of the nominal simulation
  double seconds;                // that the simulations took
  GymEntry Entry() const;
};

/// Makes all simulations. `progress` is told the share that is done, from any thread.
GymReport ScoreGym(const GymCompetitor& competitor, uint64_t seed, ThreadPool& pool,
                   const std::function<void(double)>& progress);

std::string GymJson(const GymReport& report);
/// The nominal motion in the boards' own format.
std::string GymCsv(const GymReport& report);
/// The six rows of robustness, as .svg or .png.
void DrawGym(const GymReport& report, const std::filesystem::path& file);

}  // namespace upswing
