#pragma once

#include <cstdint>
#include <string>

#include "agents/loaded_policy.h"
#include "judge/map_result.h"
#include "judge/trial.h"

namespace upswing {

/// The arguments of a policy's map: its axes, and the conditions on neither axis.
struct MapArguments {
  std::string x = "mass2=-50%:+50%", y = "length2=-50%:+50%";
  TrialArguments trial;  // its `set` may also name noise, delay and the start
  int64_t episodes = 0;  // per cell; 0: the usual number

  MapArguments() { trial.physics = kClosedForm.name; }

  /// Declares the numeric settings in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// The map that the arguments ask for, with no cell computed yet. Throws BadInput.
MapResult PlanMap(const MapArguments& a, const LoadedPolicy& loaded);

}  // namespace upswing
