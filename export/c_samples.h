#pragma once

#include <vector>

#include "export/exported_policy.h"

namespace upswing {

/// States, one control period after the other, and what a policy makes of them: by these a C header
/// tests itself. S state variables, O outputs of the network.
struct CSamples {
  int count = 0;
  std::vector<float> states, outputs, torques;       // (count × S), (count × O), (count)
  float output_tolerance = 0, torque_tolerance = 0;  // for other roundings
};

/// The same for every call. `layers` are those of the network that the header has.
CSamples DrawSamples(const ExportedPolicy& policy, const std::vector<LayerView>& layers);

}  // namespace upswing
