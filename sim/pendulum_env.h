#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/rng.h"
#include "core/vector_env.h"
#include "sim/disturbance.h"
#include "sim/double_pendulum.h"
#include "sim/physics.h"
#include "sim/randomization.h"

namespace upswing {

/// Where episodes begin: a share of them anywhere, the others hanging with normal noise on all
/// four state variables.
struct StartStates {
  double noise = 0.1;          // standard deviation, rad and rad/s
  double random_share = 0;     // of episodes that begin anywhere
  double random_velocity = 5;  // |velocity| of those is uniform up to this, rad/s
};

/// What a PendulumEnv is made of.
struct PendulumEnvConfig : PhysicsConfig {
  double episode_seconds = 10;
  int memory = 0;  // past control steps in an observation
  StartStates start;
  uint64_t seed = 0;
  std::string stream = "environment";  // environment i draws from (seed, stream, first_index + i)
  uint64_t first_index = 0;
  std::vector<Disturbance> disturbances{Disturbance()};  // one for all, or one for each
  Randomization randomization;  // around plants and disturbances, at each reset
  // The plant whose numbers energy and height in observations are reckoned with, such as that of
  // a training, so that they tell nothing of the true one; none: each environment's own.
  std::optional<Plant> assumed_plant = {};

  const Disturbance& disturbance(int env) const {
    return disturbances[disturbances.size() > 1 ? static_cast<size_t>(env) : 0];
  }
};

/// N double pendulums and their episodes. Reaching the time limit truncates; only a numerical
/// blow-up (see Physics::Step) terminates. The starts do not depend on the physics.
///
/// Of randomised plants, observation and reward are those of the episode's own plant.
/// Of a disturbance observations know what the sensors say and motors what arrives; state, reward
/// and goal are the true ones.
class PendulumEnv : public VectorEnv {
 public:
  /// Throws BadInput as MakePhysics does.
  explicit PendulumEnv(const PendulumEnvConfig& config);

  int num_envs() const override { return config_.num_envs; }
  int obs_size() const override { return kObservationSize + config_.memory * kMemorySize; }
  std::vector<std::string> reward_term_names() const override;
  double step_seconds() const override { return kControlPeriod; }
  double torque_limit() const override { return config_.plant(0).torque_limit; }
  std::vector<float> mirror_signs() const override;
  int bodies() const override { return 2; }
  void Lean(int env, std::span<double> lean) const override;
  Matrix<const float> obs() const override;
  void Step(std::span<const double> torque, StepResult& result) override;
  void SetStartNoise(double sigma) override { config_.start.noise = sigma; }
  void State(const Archive& archive) override;

  /// The plant of the running episode.
  const Plant& plant(int env) const {
    return plants_.empty() ? config_.plant(env) : plants_[static_cast<size_t>(env)];
  }
  /// The disturbance of the running episode.
  Disturbance disturbance(int env) const {
    return disturber_ ? disturber_->disturbance(env) : Disturbance();
  }
  PendulumState state(int env) const { return physics_->state(env); }
  /// Puts an environment into a state, at the beginning of an episode.
  void SetState(int env, const PendulumState& state);

 private:
  void Reset(int env);
  /// Gives a new episode its own plant and disturbance.
  void Randomize(int env);
  /// What the environment's sensors say now.
  std::array<float, kObservationSize> Observation(int env);
  /// Moves rows of kObservationSize numbers to where those of an observation with memory begin.
  void SpreadRows(std::vector<float>& table) const;
  /// Adds to a new observation (D) what is remembered under the torque chosen for the last step.
  void Remember(int env, double torque, std::span<float> obs) const;
  /// There is no successor of a state that blew up; the last that had numbers stands in for it.
  void StandIn(int env, StepResult& result) const;

  /// One environment's observation (D) within a table of them.
  template <typename Table>
  auto Row(Table& table, int env) const {
    const auto size = static_cast<size_t>(obs_size());
    return std::span(table).subspan(static_cast<size_t>(env) * size, size);
  }

  PendulumEnvConfig config_;
  std::unique_ptr<Physics> physics_;
  int64_t episode_steps_;
  std::optional<Disturber> disturber_;  // where there is something to disturb
  std::vector<Rng> rngs_;               // (N)
  // Where plants are random; else empty.
  std::vector<Plant> plants_;     // (N) of the running episodes
  std::vector<Rng> plant_rngs_;   // (N) for the next episodes'
  std::vector<Rng> plant_seeds_;  // (N) the streams as they were before the running episodes' draws
  std::vector<int64_t> step_counts_;  // (N) control steps since the episode began
  std::vector<float> obs_;            // (N, D)
};

}  // namespace upswing
