#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/archive.h"
#include "core/thread_pool.h"
#include "core/vector_env.h"
#include "sim/double_pendulum.h"

namespace upswing {

enum class PhysicsEngine {
  kMuJoCo,
  kClosedForm,  // the built-in model only: many times faster, the same to 12 digits a step
};

/// What the engines are called, the default first: "mujoco", "closed-form".
std::vector<std::string> PhysicsNames();

/// The engine of a name. Throws BadInput that begins with `where`.
PhysicsEngine ParsePhysics(std::string_view name, const std::string& where);

/// What physics are made of.
struct PhysicsConfig {
  PhysicsEngine physics = PhysicsEngine::kMuJoCo;
  std::vector<Plant> plants{Plant()};  // one for all environments, or one for each
  int num_envs = 1;
  RewardWeights weights;
  std::string mjcf;            // another model than Mjcf(Plant()); built like it
  ThreadPool* pool = nullptr;  // who shares the work; changes no bit of a result

  const Plant& plant(int env) const {
    return plants[plants.size() > 1 ? static_cast<size_t>(env) : 0];
  }
};

/// The motion of N double pendulums in lock-step, and what the task says of it.
class Physics {
 public:
  virtual ~Physics() = default;

  virtual PendulumState state(int env) const = 0;
  /// Puts an environment into a state, whatever became of it before.
  virtual void SetState(int env, const PendulumState& state) = 0;

  /// Gives an environment another plant; SetState or the loading of a state must follow.
  virtual void SetPlant(int env, const Plant& plant) = 0;

  /// Holds `torque` (N), N·m, for one control period and fills `result`, all but `truncated`; of
  /// `next_obs` N packed rows of kObservationSize, whatever the table's width. Of an
  /// environment whose state has blown up (numbers that are not finite or beyond 1e10, or a warning
  /// of MuJoCo's) only `terminated` has a meaning.
  virtual void Step(std::span<const double> torque, StepResult& result) = 0;

  /// Saves or loads the state, which plants are no part of.
  virtual void State(const Archive& archive) = 0;
};

/// Throws BadInput on a model that does not compile, is no double pendulum or not for this engine.
std::unique_ptr<Physics> MakePhysics(const PhysicsConfig& config);

}  // namespace upswing
