#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/env.h"
#include "base/error.h"

namespace upswing {

/// The task of all environments from outside the program (docs/howto/gymnasium.md). The name of an
/// environment's task is kGymnasium, a slash and the environment's name.
inline constexpr const char* kGymnasium = "gymnasium";

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

  /// The task has no seconds: a step counts as 1 s. Without `solved_return` it is never solved.
  EnvSpec Spec(int num_envs) const;
};

/// Whether this is the name of a foreign task.
bool IsForeign(std::string_view task);

/// The error for work that needs a foreign task's environment.
Error NoForeignEnvironment(const std::string& task);

struct EnvConfig;
/// Makes environments of a foreign task.
using ForeignMaker = std::function<std::unique_ptr<VectorEnv>(const EnvConfig&)>;

}  // namespace upswing
