#pragma once

#include <utility>

#include "agents/training.h"
#include "mujoco/engines.h"
#include "os/host.h"

namespace upswing {

/// This computer with both engines and `threads` threads. `make_foreign` makes the
/// environments of a foreign task.
inline Host ThisHost(int threads, ForeignMaker make_foreign = {}) {
  return {&kMuJoCo, AvailableMemory(), threads, std::move(make_foreign)};
}

}  // namespace upswing
