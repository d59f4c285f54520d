#pragma once

#include <functional>
#include <string>
#include <vector>

#include "view/view.h"

namespace upswing {

/// What the window of `view` shows.
struct WindowConfig {
  std::vector<RolloutConfig> entries;
  std::vector<std::pair<std::string, Plant>> plants;  // to switch to, with names
  ViewLook look;
  PictureSize size;
  double speed = 1;               // 1: real time
  double seconds = -1;            // of the episode after which it closes; negative: never
  uint64_t seed = 0;              // of plants at random
  std::function<bool()> stopped;  // asked for each picture; closes it
};

/// Opens the window, and returns what was seen of the first entry since its last beginning when the
/// user has closed it. Throws Failure where no window can be opened.
Rollout ShowWindow(const WindowConfig& config);

}  // namespace upswing
