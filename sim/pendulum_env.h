#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/rng.h"
#include "core/vector_env.h"
#include "sim/double_pendulum.h"
#include "sim/model.h"

namespace upswing {

/// Where episodes begin: a share of them anywhere, the others hanging with normal noise on all
/// four state variables.
struct StartStates {
  double noise = 0.1;          // standard deviation, rad and rad/s
  double random_share = 0;     // of episodes that begin anywhere
  double random_velocity = 5;  // |velocity| of those is uniform up to this, rad/s
};

/// What a PendulumEnv is made of.
struct PendulumEnvConfig {
  std::vector<Plant> plants{Plant()};  // one for all environments, or one for each
  int num_envs = 1;
  double episode_seconds = 10;
  StartStates start;
  RewardWeights weights;
  uint64_t seed = 0;
  std::string stream = "environment";  // environment i draws its starts from (seed, stream, i)
  std::string mjcf;                    // another model than Mjcf(Plant()); built like it
  int threads = 1;
};

/// N double pendulums in MuJoCo, on its batch interface. Reaching the time limit truncates; only a
/// numerical blow-up (MuJoCo's own warning, or numbers that are not finite) terminates.
class PendulumEnv : public VectorEnv {
 public:
  /// Throws BadInput on a model that does not compile or is no double pendulum.
  explicit PendulumEnv(const PendulumEnvConfig& config);

  int num_envs() const override { return config_.num_envs; }
  int obs_size() const override { return kObservationSize; }
  std::vector<std::string> reward_term_names() const override;
  double step_seconds() const override { return kControlPeriod; }
  double torque_limit() const override { return plant(0).torque_limit; }
  Matrix<const float> obs() const override;
  void Step(std::span<const double> torque, StepResult& result) override;
  void SetStartNoise(double sigma) override { config_.start.noise = sigma; }
  void State(const Archive& archive) override;

  const Plant& plant(int env) const;
  PendulumState state(int env) const;
  /// Puts an environment into a state, at the beginning of an episode.
  void SetState(int env, const PendulumState& state);

 private:
  void ObserveInto(int env, std::span<float> obs) const;
  void Reset(int env);
  bool BlewUp(int env) const;
  mjtNum* Component(mjtNum* first, int env) const { return first + env * state_size_; }

  PendulumEnvConfig config_;
  BatchPtr batch_;
  int substeps_ = 0;  // physics steps in a control period
  int64_t episode_steps_ = 0;
  int state_size_ = 0;                                          // numbers in a state row
  mjtNum *qpos_ = nullptr, *qvel_ = nullptr, *ctrl_ = nullptr;  // in row 0 of the state table
  std::vector<Rng> rngs_;                                       // (N)
  std::vector<int64_t> step_counts_;  // (N) control steps since the episode began
  std::vector<float> obs_;            // (N, D)
  std::vector<double> previous_q1_;   // (N) before the step
};

}  // namespace upswing
