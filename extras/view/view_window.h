#pragma once

#include <functional>
#include <string>
#include <vector>

#include "extras/view/view.h"

namespace upswing {

/// Settings of the window of `view`.
struct WindowConfig {
  std::vector<RolloutConfig> entries;
  std::vector<std::pair<std::string, Plant>> plants;  // plants to switch to, with names
  ViewLook look;
  PictureSize size;
  double speed = 1;               // 1: real time
  double seconds = -1;            // of an episode, after which the window closes; negative: never
  uint64_t seed = 0;              // for random plants
  std::function<bool()> stopped;  // checked for each picture; closes the window
};

/// Opens the window until the user closes it. Returns the rollout of the first entry since its last
/// start. Throws Failure if no window can be opened.
Rollout ShowWindow(const WindowConfig& config);

}  // namespace upswing
