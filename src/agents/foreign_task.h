#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/env.h"
#include "pendulum/pendulum_env.h"

namespace upswing {

/// An environment with Gymnasium's interface. Python makes and steps it.
struct ForeignTask {
  std::string name;                  // such as "CartPole-v1"
  int obs_size = 0;                  // D
  std::vector<double> action_limit;  // (A)
  std::vector<double> choices;       // (Q) the discrete actions; empty: continuous actions
  int64_t episode_steps = 0;         // largest length of an episode
  std::optional<double> solved_return;

  /// Reads the description that Python writes as JSON, the setting `environment`. Throws BadInput
  /// that begins with `where`.
  static ForeignTask Parse(const std::string& text, const std::string& where);

  /// The name of the task is `gymnasium/` and `name`. It has no seconds: a step counts as 1 s.
  /// Without `solved_return` it is never solved.
  EnvSpec Spec(int num_envs) const;
};

/// Whether this is the name of a foreign task.
bool IsForeign(std::string_view task);

struct EnvConfig;
/// Makes environments of a foreign task.
using ForeignMaker = std::function<std::unique_ptr<VectorEnv>(const EnvConfig&)>;

/// Settings of the environments of a training and its evaluations: double pendulums, or a foreign
/// task. A foreign task uses only the number of environments and their random streams.
struct EnvConfig : PendulumEnvConfig {
  std::string environment;      // description, see ForeignTask::Parse; empty: double pendulums
  ForeignMaker make_foreign;    // empty: this program cannot make foreign environments
  bool for_evaluation = false;  // environments need not go on after their first episode
  int evaluations = 0;          // number of environments of each evaluation of the training
};

/// Makes environments. Throws BadInput as PendulumEnv does, or if they cannot be made here.
std::unique_ptr<VectorEnv> MakeEnv(const EnvConfig& config);

/// The EnvSpec of the environments of MakeEnv, without making them.
EnvSpec SpecOf(const EnvConfig& config);

}  // namespace upswing
