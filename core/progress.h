#pragma once

#include <functional>

namespace upswing {

/// Told how far work has come: `done` of `total` episodes or other units, 0 < done ≤ total. Another
/// total is other work. Calls come from any thread, one at a time. An empty one is not called.
using Progress = std::function<void(double done, double total)>;

}  // namespace upswing
