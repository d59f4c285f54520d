#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/archive.h"
#include "base/env.h"
#include "base/thread_pool.h"
#include "pendulum/task_config.h"

namespace upswing {

class Physics;
struct PhysicsConfig;

/// An implementation of the physics; each is a constant.
struct Engine {
  const char* name;
  std::unique_ptr<Physics> (*make)(const PhysicsConfig& config);
};

/// The name of the MuJoCo engine, which the folder mujoco/ provides.
inline constexpr const char* kMuJoCoName = "mujoco";

/// The closed form. It is many times faster than MuJoCo, and agrees with it to 12 digits per step.
extern const Engine kClosedForm;

/// The names of both engines, the default first: "mujoco", "closed-form".
std::vector<std::string> EngineNames();

/// Settings of the physics.
struct PhysicsConfig {
  const Engine* engine = &kClosedForm;
  std::vector<Plant> plants = std::vector<Plant>(1);  // one for all environments, or one for each
  int num_envs = 1;
  RewardConfig reward;
  Scale scale;                             // units of observations and of the built-in reward
  double control_period = kControlPeriod;  // for which a torque is held, s
  int physics_steps = kPhysicsSteps;       // in a control period; PendulumEnv chooses it
  ThreadPool* pool = nullptr;              // runs the work in parallel; results have the same bits

  double timestep() const { return control_period / physics_steps; }  // of the physics, s
  const Plant& plant(int env) const {
    return plants[plants.size() > 1 ? static_cast<size_t>(env) : 0];
  }
};

/// N double pendulums stepped together, each with the task's observation and reward.
class Physics {
 public:
  virtual ~Physics() = default;

  /// The present state of an environment.
  virtual PendulumState state(int env) const = 0;
  /// Puts an environment into a state; works after a blow-up too.
  virtual void SetState(int env, const PendulumState& state) = 0;

  /// Gives an environment another plant. The caller then calls SetState or loads a state.
  virtual void SetPlant(int env, const Plant& plant) = 0;

  /// Holds `torque` (N), N·m, for one control period and fills `result` except `truncated`.
  /// Of each row of `next_obs`, it fills the first kObservationSize numbers. A state blows up if a
  /// number is not finite or beyond 1e10, or if MuJoCo warns; then only `terminated` has a meaning.
  virtual void Step(std::span<const double> torque, StepResult& result) = 0;

  /// Adds a torque (N·m) to each joint of an environment, on top of the motor's, as when a person
  /// pushes. It acts from the next step until the next Push or a new state. Throws Failure if the
  /// engine does not support pushes.
  virtual void Push(int env, const std::array<double, 2>& torque);

  /// Saves or loads the state, but not the plants.
  virtual void State(const Archive& archive) = 0;
};

}  // namespace upswing
