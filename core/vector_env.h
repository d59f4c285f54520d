#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/archive.h"
#include "core/matrix.h"

namespace upswing {

/// Result of one step of N parallel environments. D = observation size, K = number of reward terms.
struct StepResult {
  std::vector<float> next_obs;  // (N, D) true successor; of a finished episode its last observation
  std::vector<double> reward;   // (N) per control step, the weighted sum of the terms
  std::vector<double> reward_terms;  // (N, K) weighted, signed: they add up to the reward
  std::vector<double> torque;        // (N) torque that was applied, N·m
  std::vector<double> work;          // (N) |mechanical work of the motor|, J
  std::vector<uint8_t> at_goal;      // (N) whether the successor is at the goal (inverted)
  std::vector<uint8_t> terminated;   // (N) the episode ended in a state without a future
  std::vector<uint8_t> truncated;    // (N) the episode ran out of time; its state has a future

  StepResult(int num_envs, int obs_size, int num_terms)
      : next_obs(static_cast<size_t>(num_envs) * static_cast<size_t>(obs_size)),
        reward(static_cast<size_t>(num_envs)),
        reward_terms(static_cast<size_t>(num_envs) * static_cast<size_t>(num_terms)),
        torque(static_cast<size_t>(num_envs)),
        work(static_cast<size_t>(num_envs)),
        at_goal(static_cast<size_t>(num_envs)),
        terminated(static_cast<size_t>(num_envs)),
        truncated(static_cast<size_t>(num_envs)) {}

  bool done(size_t env) const { return terminated[env] != 0 || truncated[env] != 0; }
};

/// N environments stepped together, each with one continuous input (a torque) and an observation of
/// D numbers. A truncated transition bootstraps, a terminated one does not.
class VectorEnv {
 public:
  virtual ~VectorEnv() = default;

  virtual int num_envs() const = 0;                                // N
  virtual int obs_size() const = 0;                                // D
  virtual std::vector<std::string> reward_term_names() const = 0;  // (K)
  virtual double step_seconds() const = 0;                         // control period, s
  virtual double torque_limit() const = 0;                         // N·m

  /// Sign (D) of each observation under the task's mirror symmetry, step(-s, -u) = -step(s, u);
  /// empty if there is none.
  virtual std::vector<float> mirror_signs() const { return {}; }

  /// Number of bodies whose lean is defined; 0 if the task has none.
  virtual int bodies() const { return 0; }
  /// How far each body of an environment leans from its pose at the goal now (bodies), rad, in
  /// [-π, π].
  virtual void Lean(int /*env*/, std::span<double> /*lean*/) const {}

  /// Present observations (N × D); of an environment that has just finished, that of its new start.
  virtual Matrix<const float> obs() const = 0;

  /// Holds `torque` (N), N·m, for one control period. Environments that finish reset themselves.
  virtual void Step(std::span<const double> torque, StepResult& result) = 0;

  /// Standard deviation of the start states' noise from the next reset on (the curriculum).
  virtual void SetStartNoise(double sigma) = 0;

  /// Saves or loads the whole state.
  virtual void State(const Archive& archive) = 0;

  StepResult MakeResult() const {
    return {num_envs(), obs_size(), static_cast<int>(reward_term_names().size())};
  }
};

}  // namespace upswing
