#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/thread_pool.h"
#include "judge/map_result.h"
#include "judge/trial.h"
#include "setup/loaded_policy.h"

namespace upswing {

/// How a map of a policy is asked for: its axes, and what is on neither of them.
struct MapArguments {
  std::string x = "mass2=-50%:+50%", y = "length2=-50%:+50%", out;
  TrialArguments trial;  // its `set` may also name noise, delay and the start
  int64_t episodes = 0;  // in a cell; 0: as many as are usual
  double check = 0.02;   // share of the cells to repeat in MuJoCo

  MapArguments() { trial.physics = kClosedForm.name; }

  /// The numbers among them: name, range, unit, help.
  void Describe(Options& options);
};

/// The map of a policy that the arguments ask for, with no cell run yet. Throws BadInput.
MapResult PlanMap(const MapArguments& a, const LoadedPolicy& loaded);

/// The folder for a map's files, which is free. Throws BadInput, also if nothing can be drawn here.
std::filesystem::path MapFolder(const MapArguments& a, const LoadedPolicy& loaded,
                                const MapResult& map);

/// Runs all cells, and in MuJoCo the share that is to be checked there. `progress` counts episodes.
void FillMap(const MapArguments& a, const LoadedPolicy& loaded, ThreadPool& pool,
             const Progress& progress, MapResult& map);

}  // namespace upswing
