#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/env.h"
#include "sim/pendulum_env.h"

namespace upswing {

/// The tasks' names, the default first.
std::vector<std::string> TaskNames();

/// Environments of any task. Of the settings below, tasks other than the double pendulum take the
/// number of environments and their random streams.
struct EnvConfig : PendulumEnvConfig {
  std::string task = kDoublePendulum;
};

/// Throws BadInput as the task does.
std::unique_ptr<VectorEnv> MakeEnv(const EnvConfig& config);

/// What MakeEnv's environments are, without making them.
EnvSpec SpecOf(const EnvConfig& config);

}  // namespace upswing
