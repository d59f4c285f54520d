#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/env.h"
#include "core/rng.h"
#include "sim/disturbance.h"
#include "sim/double_pendulum.h"
#include "sim/identification.h"
#include "sim/physics.h"
#include "sim/randomization.h"

namespace upswing {

/// Start states: a share of the episodes begins at random angles and velocities, the others hanging
/// with normal noise on all four state variables.
struct StartStates {
  double noise = 0.1;          // standard deviation, rad and rad/s
  double random_share = 0;     // of the episodes that begin at random angles in [-π, π]
  double random_velocity = 5;  // whose velocities are uniform within ± this, rad/s
};

/// Settings of a PendulumEnv.
struct PendulumEnvConfig : PhysicsConfig {
  double episode_seconds = kEvaluationSeconds;
  int memory = 0;  // past control steps in an observation
  StartStates start;
  uint64_t seed = 0;
  std::string stream = "environment";  // environment i draws from (seed, stream, first_index + i)
  uint64_t first_index = 0;
  std::vector<Disturbance> disturbances{Disturbance()};  // one for all, or one for each
  Randomization randomization;  // around plants and disturbances, at each reset
  // The plant by which energy and height in observations are computed, such as that of a training,
  // so that they reveal nothing of the true one; none: each environment's own.
  std::optional<Plant> assumed_plant = {};
  // The nominal plant, such as that of a training, from which the plant is identified as it moves:
  // the observation holds the estimate too, and energy and height are computed by the nominal one.
  std::optional<Plant> identified_from = {};

  const Disturbance& disturbance(int env) const {
    return disturbances[disturbances.size() > 1 ? static_cast<size_t>(env) : 0];
  }
};

/// What environments of these settings are: the task "double-pendulum". An evaluation episode lasts
/// 20 s, its return is that of the first 10 s, and it succeeds if both links are inverted
/// throughout the last 10 s.
EnvSpec PendulumSpec(const PendulumEnvConfig& config);

/// N double pendulums and their episodes. Reaching the time limit truncates; only a numerical
/// blow-up (see Physics::Step) terminates. The starts do not depend on the physics.
///
/// With randomised plants, observation and reward are those of the episode's own plant. With
/// disturbances, observations hold what the sensors measure, and motors apply the delayed torque;
/// state, reward and goal are the true ones.
class PendulumEnv : public VectorEnv {
 public:
  /// Throws BadInput as the engine does.
  explicit PendulumEnv(const PendulumEnvConfig& config);

  const EnvSpec& spec() const override { return spec_; }
  void Lean(int env, std::span<double> lean) const override;
  Matrix<const float> obs() const override;
  void Step(Matrix<const double> action, StepResult& result) override {
    Step(action.values(), result);
  }
  /// The same with the torque (N), N·m.
  void Step(std::span<const double> torque, StepResult& result);
  void GetState(int env, std::span<double> state) const override;
  void SetState(int env, std::span<const double> state) override;
  void SetStartNoise(double sigma) override { config_.start.noise = sigma; }
  void State(const Archive& archive) override;

  /// Begins another episode of an environment, as Gymnasium's reset asks for. With a seed, this
  /// episode and those that follow are the ones that a first environment of a new set with this
  /// seed would have.
  void Restart(int env, std::optional<uint64_t> seed);
  /// Lets the next Step leave an environment as it is: its successor is the present observation,
  /// all else of its result 0.
  void Hold(int env);

  /// The plant of the running episode.
  const Plant& plant(int env) const {
    return plants_.empty() ? config_.plant(env) : plants_[static_cast<size_t>(env)];
  }
  /// The disturbance of the running episode.
  Disturbance disturbance(int env) const {
    return disturber_ ? disturber_->disturbance(env) : Disturbance();
  }
  PendulumState state(int env) const { return physics_->state(env); }
  /// See Physics::Push.
  void Push(int env, const std::array<double, 2>& torque) { physics_->Push(env, torque); }
  /// Begins an episode of an environment in a state.
  void SetState(int env, const PendulumState& state);

 private:
  void Reset(int env);
  /// Gives a new episode its own plant and disturbance.
  void Randomize(int env);
  /// What the environment's sensors measure now, after a control period of this torque (N·m), at
  /// the start 0; draws their noise.
  PendulumState Measure(int env, double torque);
  /// Lets the identification learn from that.
  void Identify(int env, double torque, const PendulumState& measured);
  /// The observation of what was measured, without memory and identification.
  std::array<float, kObservationSize> Observation(int env, const PendulumState& measured) const;
  /// Moves rows of kObservationSize numbers to where those of an observation with memory begin.
  void SpreadRows(std::vector<float>& table) const;
  /// Puts the environments that are held back into their states.
  void RestoreHeld();
  /// Replaces the result of a step that blew up, or that was not made: the successor by the last
  /// observation, the rest by zeros.
  void StandIn(int env, StepResult& result) const;

  /// One environment's observation (D) within a table of them.
  template <typename Table>
  auto Row(Table& table, int env) const {
    const auto size = static_cast<size_t>(spec_.obs_size);
    return std::span(table).subspan(static_cast<size_t>(env) * size, size);
  }

  PendulumEnvConfig config_;
  EnvSpec spec_;
  std::unique_ptr<Physics> physics_;
  int64_t episode_steps_;
  std::optional<Disturber> disturber_;  // none if sensors and motors are perfect
  std::vector<Rng> rngs_;               // (N)
  // With randomised plants; else empty.
  std::vector<Plant> plants_;     // (N) of the running episodes
  std::vector<Rng> plant_rngs_;   // (N) for those of the next episodes
  std::vector<Rng> plant_seeds_;  // (N) the streams as they were before the running episodes' draws
  std::vector<int64_t> step_counts_;                // (N) control steps since the episode began
  std::vector<std::optional<PendulumState>> held_;  // (N) states that the next Step keeps; or empty
  std::vector<float> obs_;                          // (N, D)
  std::optional<Identifier> identifier_;            // if plants are identified
};

}  // namespace upswing
