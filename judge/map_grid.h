#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/policy.h"
#include "core/progress.h"
#include "core/thread_pool.h"
#include "sim/pendulum_env.h"

/// Maps of how a policy does over two quantities: a grid of cells, some episodes in each.
namespace upswing {

/// All that a cell can set: plant, disturbance, and the start of every episode.
struct MapPoint {
  Plant plant;
  Disturbance disturbance;
  double q1 = 0, q2 = 0;  // degrees
  double w1 = 0, w2 = 0;  // rad/s

  void Describe(Options& options);
  PendulumState start() const;
};

/// One side of the grid.
struct MapAxis {
  std::string name;                   // of a setting of MapPoint, or of an alias
  std::string unit;                   // such as "kg"
  std::vector<double> values;         // (n) one for each cell, rising
  std::optional<double> at_training;  // where the training was, if that is one number
  bool start = false;                 // it says where episodes begin

  /// Such as "mass2 (kg)".
  std::string label() const;
};

/// Reads NAME=FROM:TO[:CELLS] ([:CELLS] is 31, or one for each step of what goes in steps), where
/// both ends may be percentages on top of what `training` has. `where` begins the message of the
/// BadInput that it throws.
MapAxis ParseMapAxis(const std::string& text, const MapPoint& training, const std::string& where);

/// Throws BadInput if both axes set the same.
void CheckDifferent(const MapAxis& x, const MapAxis& y);

/// What a map is made of.
struct MapConfig {
  MapPoint point;            // what is on neither axis
  MapAxis x, y;              // (nx), (ny)
  bool start_given = false;  // episodes begin at the point's start, else hanging with usual noise
  int episodes = 1;          // in a cell
  PendulumEnvConfig env;     // the rest; its seed also draws the cells to check

  int64_t cells() const { return static_cast<int64_t>(x.values.size() * y.values.size()); }
  /// What cell `i` sets; cells go along x first.
  MapPoint PointOf(int64_t cell) const;
};

/// Result of a cell's episodes.
struct MapCell {
  int64_t successes = 0;
  double swing_up_seconds = 0;  // median over the successful ones; NaN if there are none
};

/// Results of the listed cells, in the order of the list. The pool shares the work, which changes
/// no bit; a cell does not depend on which others there are. `progress` counts episodes.
std::vector<MapCell> RunMap(const MapConfig& config, const Policy& policy,
                            std::span<const int64_t> cells, ThreadPool& pool,
                            const Progress& progress);

/// `share` of the cells (at least one if it is not 0), drawn by the seed, in rising order.
std::vector<int64_t> DrawCells(const MapConfig& config, double share);

}  // namespace upswing
