#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "setup/config.h"

namespace upswing {

/// Throws BadInput that begins with `where` if settings, each of which is allowed, contradict each
/// other, or do not exist in the task.
void CheckSettings(Config& config, const std::string& where);

/// Settings that are allowed but hardly intended, because nothing would be learned: a line each.
std::vector<std::string> Warnings(const Config& config);

/// Approximate size of a training.
struct TrainingSize {
  double memory;      // bytes at most, with a full replay memory
  double checkpoint;  // bytes of the file then
};
TrainingSize SizeOf(const Config& config);

/// Throws BadInput if `runs` trainings at a time do not fit into so many bytes.
void CheckMemory(const Config& config, int64_t available, int64_t runs = 1);

}  // namespace upswing
