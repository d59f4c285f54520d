#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "agents/config.h"

namespace upswing {

/// Throws BadInput that begins with the name of a setting if settings contradict each other,
/// although each is in its range. Also throws it if a setting does not exist in the task.
void CheckSettings(Config& config);

/// Warnings, one per line, about settings with which the agent would hardly learn.
std::vector<std::string> Warnings(const Config& config);

/// Approximate size of a training.
struct TrainingSize {
  double memory;      // largest memory use, bytes: with a full replay memory
  double checkpoint;  // size of the checkpoint file at that time, bytes
};
TrainingSize SizeOf(const Config& config);

/// Throws BadInput if `runs` simultaneous trainings do not fit into `available` bytes.
void CheckMemory(const Config& config, int64_t available, int64_t runs = 1);

}  // namespace upswing
