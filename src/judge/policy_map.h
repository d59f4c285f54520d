#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "agents/loaded_policy.h"
#include "judge/map_result.h"
#include "judge/trial.h"

namespace upswing {

/// The arguments of a policy's map: its axes, and the conditions on neither axis.
struct MapArguments {
  std::string x = "mass2=-50%:+50%", y = "length2=-50%:+50%";
  TrialArguments trial;          // without `set`
  std::vector<std::string> set;  // changes of the plant, noise, delay and the start
  int64_t episodes = 0;          // per cell; 0: the usual number

  MapArguments() { trial.physics = kClosedForm.name; }

  /// Declares the numeric settings in `options`: name, range, unit, help.
  void Describe(Options& options);
  /// The trial for which a policy is loaded: its `set` has the changes of the plant.
  TrialArguments PlantTrial() const;
};

/// The map that the arguments ask for, with no cell computed yet. Throws BadInput.
MapResult PlanMap(const MapArguments& a, const LoadedPolicy& loaded);

}  // namespace upswing
