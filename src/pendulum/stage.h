#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/env.h"
#include "base/rng.h"
#include "pendulum/disturbance.h"
#include "pendulum/goal.h"
#include "pendulum/physics.h"

/// The stages of a control step. A PendulumEnv has physics and a list of stages around it. Each
/// stage is one part of the task, such as a delay of the motors, and overrides the hooks that it
/// needs. A part that the settings do not ask for is not in the list.
namespace upswing {

/// The running episodes of N environments, which all stages see.
struct Episodes {
  std::unique_ptr<Physics> physics;
  std::vector<Plant> plants;                       // (N)
  std::vector<Disturbance> disturbances;           // (N)
  std::vector<int64_t> steps;                      // (N) control steps since the start
  std::vector<int64_t> goals;                      // (N) indices of kPoses; empty: always upright
  std::vector<std::optional<PendulumState>> held;  // (N) states that this step keeps; or empty

  PendulumState state(int env) const { return physics->state(env); }
  /// The pose to reach; nothing if it is always upright.
  std::optional<Pose> goal(int env) const {
    if (goals.empty()) return std::nullopt;
    return kPoses[static_cast<size_t>(goals[static_cast<size_t>(env)])];
  }
  bool is_held(int env) const {
    return !held.empty() && held[static_cast<size_t>(env)].has_value();
  }
};

/// The start of an episode, while it is drawn.
struct EpisodeStart {
  PendulumState state;
  bool is_random;  // whether the state is random, and not near hanging
  Rng& rng;        // stream of the start states
};

/// A control step of N environments.
struct ControlStep {
  Episodes& episodes;
  std::span<const double> chosen;   // (N) torques that the controller chose, N·m
  std::span<const double> applied;  // (N) torques that the motors apply, N·m
  Matrix<const float> obs;          // (N × D) observations at which they were chosen
  StepResult& result;

  int num_envs() const { return obs.rows(); }
  /// The observation (D) of an environment's successor.
  std::span<float> next_obs(int env) const {
    const auto size = static_cast<size_t>(obs.cols());
    return std::span(result.next_obs).subspan(static_cast<size_t>(env) * size, size);
  }
  /// Whether an environment moves into a valid state: it is not held, and did not blow up.
  bool moves(int env) const {
    return !episodes.is_held(env) && result.terminated[static_cast<size_t>(env)] == 0;
  }
};

/// A part of the task. The hooks are in the order of their calls; each calls all stages in the
/// order of the list. Each does nothing by default.
class Stage {
 public:
  virtual ~Stage() = default;

  // ---- The start of an episode.

  /// Replaces an environment's random stream by the stream of this seed.
  virtual void Seed(int /*env*/, uint64_t /*seed*/) {}
  /// Draws the conditions of an episode, on which its start state may depend.
  virtual void Prepare(int /*env*/, Episodes& /*episodes*/) {}
  /// Changes the start that was drawn.
  virtual void Place(int /*env*/, Episodes& /*episodes*/, EpisodeStart& /*start*/) {}
  /// Begins an episode in the state that physics has now. `obs` (D) is its first observation. It
  /// has the numbers of the true state already, and zeros.
  virtual void Begin(int /*env*/, Episodes& /*episodes*/, std::span<float> /*obs*/) {}

  // ---- A control step.

  /// Acts before physics: may replace `applied`.
  virtual void Act(ControlStep& /*step*/) {}
  /// Judges the successors: reward and goal.
  virtual void Judge(ControlStep& /*step*/) {}
  /// Completes the observations of the successors. Physics has written the numbers of the true
  /// states.
  virtual void Observe(ControlStep& /*step*/) {}
  /// Counts the step and truncates episodes.
  virtual void KeepTime(ControlStep& /*step*/) {}

  // ---- Saved runs.

  /// Saves or loads the stage's state. It is called before physics loads its own.
  virtual void State(const Archive& /*archive*/, Episodes& /*episodes*/) {}
};

}  // namespace upswing
