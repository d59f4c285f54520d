#pragma once

#include <functional>

namespace upswing {

/// Callback for the progress of some work: `done` of `total` episodes or other units, 0 <
/// done ≤ total. A different `total` means different work. Any thread may call it, but only one at
/// a time. An empty callback is not called.
using Progress = std::function<void(double done, double total)>;

}  // namespace upswing
