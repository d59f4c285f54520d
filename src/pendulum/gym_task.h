#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/env.h"
#include "base/rng.h"

namespace upswing {

/// Settings of a GymTask.
struct GymTaskConfig {
  int num_envs = 1;
  uint64_t seed = 0;
  std::string stream = "environment";  // environment i draws from (seed, stream, first_index + i)
  uint64_t first_index = 0;
};

/// N environments of a small Gymnasium task (https://gymnasium.farama.org) with one torque. This
/// class limits the torque, counts steps, truncates, resets and saves; a derived class has the
/// equations. Letters: S state variables, D observation size, K reward terms.
class GymTask : public VectorEnv {
 public:
  const EnvSpec& spec() const override { return spec_; }
  Matrix<const float> obs() const override { return {obs_.data(), num_envs(), spec_.obs_size}; }
  void Step(Matrix<const double> action, StepResult& result) override;
  void GetState(int env, std::span<double> state) const override;
  /// Throws BadInput unless each state variable is within its bound.
  void SetState(int env, std::span<const double> state) override;
  void State(const Archive& archive) override;

 protected:
  /// Limits of the task, in addition to `spec`; the settings replace num_envs of `spec`.
  struct Limits {
    int64_t episode_steps;            // length after which an episode is truncated
    std::vector<double> start_bound;  // (S) a start state is uniform within ± this
    std::vector<double> state_bound;  // (S) SetState accepts, and every step stays in, ± this
  };

  /// A derived class calls Begin at the end of its constructor.
  GymTask(EnvSpec spec, Limits limits, const GymTaskConfig& config);
  /// Begins the first episode of every environment.
  void Begin();

  /// Moves the states (S × N, one row for each variable) by one step under `torque` (N), N·m. Fills
  /// `result` except next_obs, reward, torque and truncated.
  virtual void Move(Matrix<double> states, std::span<const double> torque,
                    StepResult& result) const = 0;
  /// Writes the observations (n × D) of n states (S × n).
  virtual void Observe(Matrix<const double> states, Matrix<float> obs) const = 0;

 private:
  int num_states() const { return static_cast<int>(limits_.state_bound.size()); }  // S
  Matrix<double> states() { return {states_, num_states(), num_envs()}; }
  Matrix<float> Observations() { return {obs_, num_envs(), spec_.obs_size}; }
  /// Begins a new episode of an environment in a random start state.
  void Reset(int env);
  /// Begins a new episode of an environment in its present state.
  void BeginEpisode(int env);

  EnvSpec spec_;
  Limits limits_;
  std::vector<Rng> rngs_;             // (N) for the start states
  std::vector<double> states_;        // (S, N)
  std::vector<float> obs_;            // (N, D)
  std::vector<int64_t> step_counts_;  // (N) steps since the episode began
};

}  // namespace upswing
