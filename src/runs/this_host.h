#pragma once

#include <utility>

#include "agents/training.h"
#include "mujoco/engines.h"
#include "os/host.h"

namespace upswing {

/// This computer with all engines of the program and `threads` threads. `make_foreign` makes the
/// environments of a foreign task.
inline Host ThisHost(int threads, ForeignMaker make_foreign = {}) {
  return {AllEngines(), AvailableMemory(), threads, std::move(make_foreign)};
}

}  // namespace upswing
