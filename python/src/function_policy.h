#pragma once

#include <nanobind/nanobind.h>

#include "setup/loaded_policy.h"

namespace upswing {

/// A policy of the double pendulum that asks a Python function: observations (N × D, float32) →
/// torques, N·m (N, or N × 1). Its observations remember `memory` steps.
LoadedPolicy MakeFunctionPolicy(nanobind::callable function, int memory);

}  // namespace upswing
