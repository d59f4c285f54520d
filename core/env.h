#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/archive.h"
#include "core/evaluation_rule.h"
#include "core/matrix.h"

namespace upswing {

/// What a task is, apart from its state. Letters: N environments, D observation size, A action
/// size, K reward terms, S state variables.
struct EnvSpec {
  std::string task;                      // its name, such as "double-pendulum"
  int num_envs = 1;                      // N
  int obs_size = 0;                      // D
  std::vector<double> action_limit;      // (A) component i of an action is within ± this
  std::string action_unit = "N·m";       // of an action's components, such as torques
  double step_seconds = 0;               // control period, s
  std::vector<std::string> term_names;   // (K) of the reward's terms
  std::vector<std::string> state_names;  // (S) such as "q1"
  std::vector<std::string> state_units;  // (S) such as "rad"
  // Sign (D) of each observation under the task's mirror symmetry, step(-s, -u) = -step(s, u);
  // empty if there is none.
  std::vector<float> mirror_signs;
  int bodies = 0;  // whose lean is defined (VectorEnv::Lean); 0: none
  EvaluationRule evaluation;

  int action_size() const { return static_cast<int>(action_limit.size()); }  // A
};

/// Result of one step of N parallel environments.
struct StepResult {
  std::vector<float> next_obs;  // (N, D) true successor; of a finished episode its last observation
  std::vector<double> reward;   // (N) per control step, the weighted sum of the terms
  std::vector<double> reward_terms;  // (N, K) weighted, signed: they add up to the reward
  std::vector<double> torque;       // (N, A) action that was applied: after delay, within its limit
  std::vector<double> work;         // (N) |mechanical work of the motors|, J
  std::vector<uint8_t> at_goal;     // (N) whether the successor is at the goal
  std::vector<uint8_t> terminated;  // (N) the episode ended in a state without a future
  std::vector<uint8_t> truncated;   // (N) the episode ran out of time; its state has a future

  explicit StepResult(const EnvSpec& spec);

  bool done(size_t env) const { return terminated[env] != 0 || truncated[env] != 0; }
};

/// N environments stepped together. Actions are continuous; an agent with discrete ones owns the
/// table of them. A truncated transition bootstraps, a terminated one does not.
class VectorEnv {
 public:
  virtual ~VectorEnv() = default;

  virtual const EnvSpec& spec() const = 0;
  int num_envs() const { return spec().num_envs; }

  /// Present observations (N × D); of an environment that has just finished, that of its new start.
  virtual Matrix<const float> obs() const = 0;

  /// Holds `action` (N × A) for one control period; components beyond their limit are clamped.
  /// Environments that finish reset themselves.
  virtual void Step(Matrix<const double> action, StepResult& result) = 0;

  /// The state (S) of an environment, and the beginning of an episode in a given one.
  virtual void GetState(int env, std::span<double> state) const = 0;
  virtual void SetState(int env, std::span<const double> state) = 0;

  /// How far each body of an environment leans from its pose at the goal now (bodies), rad, in
  /// [-π, π].
  virtual void Lean(int /*env*/, std::span<double> /*lean*/) const {}

  /// Standard deviation of the start states' noise from the next reset on (the curriculum); tasks
  /// whose starts have no such noise ignore it.
  virtual void SetStartNoise(double /*sigma*/) {}

  /// Saves or loads the whole state.
  virtual void State(const Archive& archive) = 0;

  StepResult MakeResult() const { return StepResult(spec()); }
};

}  // namespace upswing
