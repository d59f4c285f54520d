#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/config.h"

namespace upswing {

/// What can be trained but is hardly meant, a line for each: nothing would be learned.
std::vector<std::string> Warnings(const Config& config);

/// What a training takes, about.
struct TrainingSize {
  double memory;      // bytes at most, with a full replay memory
  double checkpoint;  // bytes of the file then
};
TrainingSize SizeOf(const Config& config);

/// Throws BadInput if there is too little memory for `runs` trainings at a time.
void CheckMemory(const Config& config, int64_t runs = 1);

}  // namespace upswing
