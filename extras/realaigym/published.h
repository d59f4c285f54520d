#pragma once

#include <array>
#include <string>
#include <vector>

#include "extras/realaigym/rules.h"

/// The published entries of RealAIGym's boards, best first. docs/results/realaigym.md names the
/// commits and dates.
namespace upswing::realaigym {

/// An entry of the simulation boards, score version 2: published, or a competitor's.
struct BoardEntry {
  std::string name;
  double seconds, energy, torque_cost, smoothness, velocity_cost, performance;
  std::array<double, kRobustnessRows> rows;  // shares
  double robustness;
};
std::vector<BoardEntry> PublishedEntries(Robot robot);

/// An entry of the hardware boards, score version 2. The measures are those of its best run.
struct HardwareEntry {
  std::string name;
  int successes;  // of ten runs
  double seconds, energy, torque_cost, smoothness, velocity_cost;
  double best, mean;  // scores of ten runs; a failure counts 0
};
/// Entries with pushes were scored with HardwareScales; others are left out.
std::vector<HardwareEntry> PublishedHardwareEntries(Robot robot, bool pushed);

/// An entry of the boards of ICRA 2025, score version 3.
struct UptimeEntry {
  std::string name;
  double score;   // of the only simulation, or the mean of the runs on the machine
  int swing_ups;  // of the best run
};
std::vector<UptimeEntry> PublishedUptimes(Robot robot, bool hardware);

}  // namespace upswing::realaigym
