#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/archive.h"
#include "base/evaluation_rule.h"
#include "base/matrix.h"

namespace upswing {

/// Static description of a task. Letters: N environments, D observation size, A action size, K
/// reward terms.
struct EnvSpec {
  std::string task;                  // name of the task, such as "double-pendulum"
  int num_envs = 1;                  // N
  int obs_size = 0;                  // D
  std::vector<double> action_limit;  // (A) component i of an action is in ± action_limit[i]
  // (Q) The only actions of a task with discrete actions, where A = 1. Empty: any action within the
  // limit.
  std::vector<double> choices = {};
  std::string action_unit = "N·m";      // unit of the action's components
  double step_seconds = 0;              // control period, s
  std::vector<std::string> term_names;  // (K) names of the reward's terms
  // (D) Sign of each observation under the task's mirror symmetry, step(-s, -u) = -step(s, u).
  // Empty if the task has no such symmetry.
  std::vector<float> mirror_signs;
  int bodies = 0;  // bodies that have a lean (VectorEnv::Lean); 0: none
  EvaluationRule evaluation;

  int action_size() const { return static_cast<int>(action_limit.size()); }  // A
};

/// Result of one step of N parallel environments.
struct StepResult {
  std::vector<float> next_obs;       // (N, D) true successor, not the start of the next episode
  std::vector<double> reward;        // (N) weighted sum of the reward terms in this control step
  std::vector<double> reward_terms;  // (N, K) signed, weighted terms; their sum is the reward
  std::vector<double> torque;        // (N, A) applied action, after delay and clamping
  std::vector<double> work;          // (N) |mechanical work of the motors|, J
  std::vector<uint8_t> at_goal;      // (N) whether the successor is at the goal
  std::vector<uint8_t> terminated;   // (N) whether the episode ended in a state without a future
  std::vector<uint8_t> truncated;    // (N) whether time ran out; the last state has a future

  explicit StepResult(const EnvSpec& spec);

  bool done(size_t env) const { return terminated[env] != 0 || truncated[env] != 0; }
};

/// N environments that step together. Actions are continuous; an agent with discrete actions owns
/// the table that maps them to torques. A truncated transition bootstraps; a terminated transition
/// does not.
class VectorEnv {
 public:
  virtual ~VectorEnv() = default;

  virtual const EnvSpec& spec() const = 0;
  int num_envs() const { return spec().num_envs; }

  /// Current observations (N × D). For an environment whose episode has just ended, the first
  /// observation of its new episode.
  virtual Matrix<const float> obs() const = 0;

  /// Applies `action` (N × A) for one control period and clamps its components to their limits. An
  /// environment whose episode ends resets itself.
  virtual void Step(Matrix<const double> action, StepResult& result) = 0;

  /// Writes the lean of each body (bodies): its angle from its pose at the current goal, in [-π, π]
  /// rad.
  virtual void Lean(int /*env*/, std::span<double> /*lean*/) const {}

  /// Sets the standard deviation of the noise in the start states, from the next reset on (the
  /// curriculum). Tasks without such noise ignore it.
  virtual void SetStartNoise(double /*sigma*/) {}

  /// Saves or loads the whole state of the environments.
  virtual void State(const Archive& archive) = 0;
  /// After State has loaded: the last observations (N × D) of the saved episodes, if the
  /// environments cannot continue them and began new ones; else empty.
  virtual Matrix<const float> broken_off() const { return {}; }

  StepResult MakeResult() const { return StepResult(spec()); }
};

}  // namespace upswing
