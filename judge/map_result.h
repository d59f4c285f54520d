#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "judge/map_grid.h"
#include "run/model_info.h"

namespace upswing {

/// How far the engines agree on the cells that were repeated.
struct MapAgreement {
  int64_t cells = 0, same_successes = 0;   // cells, and those with as many successes
  double largest_success_difference = 0;   // of the rates
  int64_t both_succeed = 0;                // cells where both have successes
  double largest_swing_up_difference = 0;  // of the medians of these, s
};

/// A finished map.
struct MapResult {
  MapConfig config;
  std::string policy, title;       // path; short, for a figure of several
  std::optional<ModelInfo> model;  // none: the built-in one
  std::string changes;             // what is not as in the training, the axes aside; empty: nothing
  std::string dot;                 // label of the training's place; empty: it is not on the map
  std::vector<MapCell> cells;      // (ny × nx)
  std::vector<int64_t> checked;    // cells that were repeated in MuJoCo, rising
  std::vector<MapCell> in_mujoco;  // their results there
  double seconds = 0;              // wall time of the map itself
  std::vector<std::string> files;  // written

  int64_t episodes() const { return config.cells() * config.episodes; }
  double mean_success() const;     // rate over all episodes
  double always_success() const;   // share of the cells where every episode succeeds
  double median_swing_up() const;  // of the cells' medians, s; NaN if there are none
  MapAgreement agreement() const;
  /// What a cell without a failure implies, as text: `10 of 10: 95% interval 72.2% to 100%`.
  std::string success_interval() const;
};

/// One row for each cell, x first; MuJoCo's results are empty where the cell was not repeated.
std::string MapCsv(const MapResult& map);

/// Throws BadInput unless all have the same axes.
void CheckSameAxes(const std::vector<MapResult>& maps);

/// Writes map.csv, map.svg and map.png into a folder and notes them in the map's `files`; of
/// several maps map-1.csv, map-2.csv, … and maps.svg and maps.png, where the success of each is a
/// panel, all with one scale of colours.
void WriteMaps(std::vector<MapResult>& maps, const std::filesystem::path& folder);

/// The map as a JSON document, or a list of several.
std::string MapsJson(const std::vector<MapResult>& maps);

}  // namespace upswing
