#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/policy.h"
#include "base/progress.h"
#include "base/thread_pool.h"
#include "pendulum/pendulum_env.h"

/// Maps of a policy's success over two quantities: a grid of cells, with some episodes in each.
namespace upswing {

/// The conditions that a cell can set: plant, disturbance, and the start of every episode.
struct MapPoint {
  Plant plant;
  Disturbance disturbance;
  double q1 = 0, q2 = 0;                   // degrees
  double w1 = 0, w2 = 0;                   // rad/s
  double control_period = kControlPeriod;  // s, of the policy; not a setting

  void Describe(Options& options);
  PendulumState start() const;
};

/// One axis of the grid.
struct MapAxis {
  std::string name;                   // of a setting of MapPoint, or an alias
  std::vector<std::string> settings;  // names of the settings that it sets
  std::string unit;                   // such as "kg"
  std::vector<double> values;         // (n) one for each cell, ascending
  std::optional<double> at_training;  // value in the training, if it is a single number
  bool start = false;                 // whether it sets where episodes begin

  /// Name and unit, such as "mass2 (kg)".
  std::string label() const;
  /// Whether it sets this setting.
  bool Sets(const std::string& setting) const;
};

/// Changes of a MapPoint, NAME=VALUE, with start angles in degrees and start velocities in rad/s as
/// its settings have them. Their VALUE may have a unit (pendulum/start_text.h). Throws BadInput.
std::vector<std::string> InUnitsOfMap(std::vector<std::string> changes, const std::string& flag);

/// Parses NAME=FROM:TO[:CELLS]. Start angles and velocities may have a unit. CELLS defaults to 31,
/// or to one cell per step for a setting with steps. Both ends may be percentages relative to the
/// value in `training`. Throws BadInput with a message that begins with `where`.
MapAxis ParseMapAxis(const std::string& text, const MapPoint& training, const std::string& where);

/// The definition of a map.
struct MapConfig {
  MapPoint point;            // conditions on neither axis
  MapAxis x, y;              // (nx), (ny)
  bool start_given = false;  // start at `point`'s start; else hanging with the usual noise
  int episodes = 1;          // per cell
  PendulumEnvConfig env;     // other conditions

  int64_t cells() const { return static_cast<int64_t>(x.values.size() * y.values.size()); }
  /// The conditions of cell `i`; cells are counted along x first.
  MapPoint PointOf(int64_t cell) const;
};

/// Result of a cell's episodes.
struct MapCell {
  int64_t successes = 0;
  double swing_up_seconds = 0;  // median over successful episodes; NaN if there are none
};

/// Results of all cells. The pool shares the work without changing a bit. `progress` counts
/// episodes.
std::vector<MapCell> RunMap(const MapConfig& config, const Policy& policy, ThreadPool& pool,
                            const Progress& progress);

}  // namespace upswing
