#pragma once

#include "agents/training.h"

namespace upswing {

/// This computer with all engines of the program and `threads` threads. `make_foreign` makes the
/// environments of a foreign task.
Host ThisHost(int threads, ForeignMaker make_foreign = {});

}  // namespace upswing
