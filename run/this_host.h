#pragma once

#include "setup/training.h"

namespace upswing {

/// This computer with all engines of the program and `threads` threads.
Host ThisHost(int threads);

}  // namespace upswing
