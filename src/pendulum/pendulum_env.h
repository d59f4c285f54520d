#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/env.h"
#include "base/rng.h"
#include "pendulum/disturbance.h"
#include "pendulum/physics.h"
#include "pendulum/randomization.h"
#include "pendulum/stage.h"
#include "pendulum/start_states.h"
#include "pendulum/task.h"

namespace upswing {

/// Settings of a PendulumEnv. Times are in s, velocities in rad/s. Only `scale` counts in units of
/// the built-in plant.
struct PendulumEnvConfig : PhysicsConfig {
  double episode_seconds = kEvaluationSeconds;
  int memory = 0;  // number of past control steps in an observation
  // Whether an episode asks for one of kPoses, its goal, which observations contain. Reward and
  // goal are then of this pose.
  bool any_pose = false;
  // With any_pose: the goal of every episode. None: each episode draws its goal, and begins in a
  // random state or, with the noise of its start, in another pose.
  std::optional<Pose> goal = {};
  StartStates start;
  uint64_t seed = 0;
  std::string stream = "environment";  // environment i draws from (seed, stream, first_index + i)
  uint64_t first_index = 0;
  std::vector<Disturbance> disturbances{Disturbance()};  // one for all, or one for each
  Randomization randomization;  // around plants and disturbances, drawn at each reset
  // The plant that gives energy and height in observations, such as the plant of the training.
  // Observations then reveal nothing of the true plant. None: each environment's own plant.
  std::optional<Plant> assumed_plant = {};
  // The nominal plant where identification starts, such as the plant of the training. Observations
  // then hold the estimate, and take energy and height from the nominal plant.
  std::optional<Plant> identified_from = {};

  const Disturbance& disturbance(int env) const {
    return disturbances[disturbances.size() > 1 ? static_cast<size_t>(env) : 0];
  }
};

/// Throws BadInput unless the control period is in its range and delays are multiples of it.
void CheckPeriods(const PendulumEnvConfig& config);

/// States in which the reward differs from the reward in their mirror image, with both rewards, for
/// messages. Empty: the reward is symmetric, so that mirrored transitions are true.
std::string RewardAsymmetry(const PendulumEnvConfig& config);

/// The specification of the task "double-pendulum" with these settings. In units of `scale`, an
/// evaluation episode lasts 20 s and its return counts the first 10 s. It succeeds if both links
/// are inverted throughout the last 10 s. It has mirror signs if the reward is symmetric.
EnvSpec PendulumSpec(const PendulumEnvConfig& config);

/// N double pendulums and their episodes. Reaching the time limit truncates; only a numerical
/// blow-up (see Physics::Step) terminates. The start states do not depend on physics and
/// actions, unless a drive leads to them.
///
/// With randomised plants, observation and reward use the plant of the episode. With disturbances,
/// observations hold what the sensors measure, and motors apply the delayed torque. State, reward
/// and goal use the true state.
class PendulumEnv : public VectorEnv {
 public:
  /// Throws BadInput under the same conditions as Engine::make, as PhysicsStepsFor does for the
  /// plants, and for delays that are not whole control periods.
  explicit PendulumEnv(const PendulumEnvConfig& config);

  const EnvSpec& spec() const override { return spec_; }
  void Lean(int env, std::span<double> lean) const override;
  Matrix<const float> obs() const override;
  void Step(Matrix<const double> action, StepResult& result) override {
    Step(action.values(), result);
  }
  /// Steps every environment under the torque (N), N·m: act, integrate, judge, observe, keep time,
  /// begin the next step.
  void Step(std::span<const double> torque, StepResult& result);
  void SetStartNoise(double sigma) override { config_.start.noise = sigma; }
  void State(const Archive& archive) override;

  /// Begins another episode of an environment, as Gymnasium's reset does. With a seed, this episode
  /// and the following ones equal those of the first environment of a new set with this seed.
  void Restart(int env, std::optional<uint64_t> seed);
  /// Makes the next Step leave an environment as it is: its successor is the present observation,
  /// and the rest of its result is 0.
  void Hold(int env);

  /// The plant of the running episode.
  const Plant& plant(int env) const { return episodes_.plants[static_cast<size_t>(env)]; }
  /// The pose that the running episode asks for; nothing without any_pose: it is upright.
  std::optional<Pose> goal(int env) const { return episodes_.goal(env); }
  /// The disturbance of the running episode.
  const Disturbance& disturbance(int env) const {
    return episodes_.disturbances[static_cast<size_t>(env)];
  }
  PendulumState state(int env) const { return episodes_.state(env); }
  /// See Physics::Push.
  void Push(int env, const std::array<double, 2>& torque) { episodes_.physics->Push(env, torque); }
  /// Begins an episode of an environment in a state.
  void SetState(int env, const PendulumState& state);

 private:
  /// Begins a new episode in a random state.
  void Reset(int env);

  /// Puts held environments back into their states.
  void RestoreHeld(StepResult& result);
  /// Replaces the results of steps that blew up or were held back: the successor by the last
  /// observation, the rest by zeros.
  void StandIn(const ControlStep& step) const;
  /// Makes the successors the present observations, and begins new episodes.
  void BeginNextStep(const StepResult& result);

  PendulumEnvConfig config_;
  EnvSpec spec_;
  Episodes episodes_;
  std::vector<std::unique_ptr<Stage>> stages_;
  std::vector<Rng> rngs_;   // (N) streams of the start states
  std::vector<float> obs_;  // (N, D)
};

}  // namespace upswing
