#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/text.h"
#include "judge/map_grid.h"

namespace upswing {

/// A finished map.
struct MapResult {
  MapConfig config;
  std::string policy, title;       // path; short title for a figure of several maps
  std::string changes;             // differences from the training, without the axes; empty: none
  std::string dot;                 // label of the training's point; empty: it is not on the map
  std::vector<MapCell> cells;      // (ny × nx)
  std::vector<std::string> files;  // written files

  /// Name of the map's folder without --out, such as `map-mass2-length2`.
  std::string folder_name() const { return Concat("map-", config.x.name, "-", config.y.name); }
  double mean_success() const;     // success rate over all episodes
  double always_success() const;   // share of cells in which every episode succeeds
  double median_swing_up() const;  // median of the cells' medians, s; NaN if there are none
  /// The success rate implied by a cell without a failure, as text: `10 of 10: 95% interval 72.2%
  /// to 100%`.
  std::string success_interval() const;
};

/// The map as CSV, one row for each cell, x first.
std::string MapCsv(const MapResult& map);

/// Throws BadInput unless all maps have the same axes.
void CheckSameAxes(const std::vector<MapResult>& maps);

/// Writes map.csv and, if possible, map.svg and map.png into a folder and adds them to the map's
/// `files`. Several maps become map-1.csv, map-2.csv, … and maps.svg and maps.png. Their figure has
/// a panel with the success of each, all with one colour scale.
void WriteMaps(std::vector<MapResult>& maps, const std::filesystem::path& folder);

/// The map as a JSON document; several maps as a list.
std::string MapsJson(const std::vector<MapResult>& maps);

}  // namespace upswing
