#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pendulum/observation.h"
#include "pendulum/own_reward.h"
#include "pendulum/posterior.h"
#include "pendulum/randomization.h"
#include "pendulum/stage.h"

/// The stages of the double pendulum's task, in the order of the list that MakeStages returns.
namespace upswing {

struct PendulumEnvConfig;

/// Random plants, sensors and motors: draws those of each episode.
class RandomConditions : public Stage {
 public:
  /// Throws BadInput if the settings draw from a posterior that they do not have.
  explicit RandomConditions(const PendulumEnvConfig& config);

  void Seed(int env, uint64_t seed) override;
  void Prepare(int env, Episodes& episodes) override;
  /// Saves each environment's stream as it was before the draws of the running episode. Loading
  /// draws again.
  void State(const Archive& archive, Episodes& episodes) override;

 private:
  Randomization randomization_;
  std::optional<Posterior> posterior_;
  std::vector<Plant> nominal_plants_;              // (N)
  std::vector<Disturbance> nominal_disturbances_;  // (N)
  double period_, timestep_;                       // of control and physics, s
  std::string stream_;
  std::vector<Rng> next_;     // (N) streams for the draws of the next episodes
  std::vector<Rng> current_;  // (N) the same before the draws of the running episodes
};

/// Motors that apply a torque some control periods after it is chosen; until then zero.
class DelayedMotors : public Stage {
 public:
  /// No episode may have a delay above `longest`, in control periods (s).
  DelayedMotors(int num_envs, double control_period, int longest);

  void Begin(int env, Episodes& episodes, std::span<float> obs) override;
  void Act(ControlStep& step) override;
  void State(const Archive& archive, Episodes& episodes) override;

 private:
  std::span<double> Queue(int env) {
    return std::span(queues_).subspan(static_cast<size_t>(env) * longest_, longest_);
  }

  double period_;                // of control, s
  size_t longest_;               // control periods
  std::vector<double> queues_;   // (N × longest) waiting torques, N·m
  std::vector<double> applied_;  // (N) N·m
};

/// Late control steps: the motors keep the torque before.
class LateSteps : public Stage {
 public:
  explicit LateSteps(const PendulumEnvConfig& config);

  void Seed(int env, uint64_t seed) override;
  void Begin(int env, Episodes& episodes, std::span<float> obs) override;
  void Act(ControlStep& step) override;
  void State(const Archive& archive, Episodes& episodes) override;

 private:
  double period_;  // of control, s
  std::string stream_;
  std::vector<Rng> rngs_;        // (N)
  std::vector<double> applied_;  // (N) N·m
  std::vector<int64_t> waits_;   // (N) further control steps that keep the torque
};

/// Episodes that ask for a pose of kPoses, the goal: draws it, judges by it and shows it in the
/// observations.
class PoseGoal : public Stage {
 public:
  explicit PoseGoal(const PendulumEnvConfig& config);

  void Place(int env, Episodes& episodes, EpisodeStart& start) override;
  void Begin(int env, Episodes& episodes, std::span<float> obs) override;
  void Judge(ControlStep& step) override;
  void Observe(ControlStep& step) override;
  void State(const Archive& archive, Episodes& episodes) override;

 private:
  std::optional<Pose> fixed_;  // the goal of every episode; none: drawn
  RewardConfig built_in_;
  Scale scale_;
  int memory_;
};

/// A reward that an expression of your own computes from the built-in terms and the state.
class ExpressionReward : public Stage {
 public:
  /// Throws BadInput if the expression has an error.
  explicit ExpressionReward(const PendulumEnvConfig& config);

  void Begin(int env, Episodes& episodes, std::span<float> obs) override;
  void Act(ControlStep& step) override;
  void Judge(ControlStep& step) override;
  void State(const Archive& archive, Episodes& episodes) override;

 private:
  OwnReward reward_;
};

/// Observations of what the sensors measure, with an identified plant and a memory of past steps.
class Perception : public Stage {
 public:
  /// `sensors`: none if they measure the true state.
  Perception(const PendulumEnvConfig& config, std::optional<NoisySensors> sensors);

  void Seed(int env, uint64_t seed) override;
  void Begin(int env, Episodes& episodes, std::span<float> obs) override;
  void Observe(ControlStep& step) override;
  void State(const Archive& archive, Episodes& episodes) override;

 private:
  /// The measurement of the present state. `torque` (N·m) acted in the last control period; 0 at
  /// the start.
  Measurement Measure(int env, const Episodes& episodes, double torque);
  /// The plant that gives energy and height.
  const Plant& ObservedPlant(int env, const Episodes& episodes) const;

  std::optional<NoisySensors> sensors_;
  std::string stream_;
  std::optional<Plant> assumed_plant_;  // none: the true plant of the episode
  // Whether the numbers of the true state that physics writes are already those of the
  // observation.
  bool keeps_true_state_;
  ObservationBuilder builder_;
};

/// The time limit of episodes.
class TimeLimit : public Stage {
 public:
  /// `limit`: control steps of an episode.
  explicit TimeLimit(int64_t limit) : limit_(limit) {}

  void Begin(int env, Episodes& episodes, std::span<float> obs) override;
  void KeepTime(ControlStep& step) override;
  void State(const Archive& archive, Episodes& episodes) override;

 private:
  int64_t limit_;
};

/// The weights of the built-in terms: those of the settings, or 1 if an expression uses the terms.
RewardConfig BuiltInReward(const PendulumEnvConfig& config);

/// The stages that the settings ask for. Throws BadInput like their constructors.
std::vector<std::unique_ptr<Stage>> MakeStages(const PendulumEnvConfig& config);

}  // namespace upswing
