#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/archive.h"
#include "core/env.h"
#include "core/thread_pool.h"
#include "sim/double_pendulum.h"

namespace upswing {

class Physics;
struct PhysicsConfig;

/// A way to compute the motion; each is a constant.
struct Engine {
  const char* name;
  /// Throws BadInput if the model does not compile, is no double pendulum, or is not for this
  /// engine.
  std::unique_ptr<Physics> (*make)(const PhysicsConfig& config);
};

/// The name of MuJoCo's engine, which mujoco/ has.
inline constexpr const char* kMuJoCoName = "mujoco";

/// Closed form: the built-in model only; many times faster than MuJoCo, equal to 12 digits a step.
extern const Engine kClosedForm;

/// Engines that a program has.
using Engines = std::span<const Engine* const>;

/// The names of all engines, whether a program has them or not; the default first: "mujoco",
/// "closed-form".
std::vector<std::string> EngineNames();

/// The engine with this name. Throws BadInput whose message begins with `where`.
const Engine& FindEngine(Engines engines, std::string_view name, const std::string& where);

/// Settings of the physics.
struct PhysicsConfig {
  const Engine* engine = &kClosedForm;
  std::vector<Plant> plants = std::vector<Plant>(1);  // one for all environments, or one for each
  int num_envs = 1;
  RewardWeights weights;
  std::string mjcf;            // replaces the built-in model if not empty; see LoadModel
  ThreadPool* pool = nullptr;  // runs the work in parallel; changes no bit of a result

  const Plant& plant(int env) const {
    return plants[plants.size() > 1 ? static_cast<size_t>(env) : 0];
  }
};

/// N double pendulums stepped together, with the task's observation and reward of each.
class Physics {
 public:
  virtual ~Physics() = default;

  /// The present state of an environment.
  virtual PendulumState state(int env) const = 0;
  /// Puts an environment into a state, also after a blow-up.
  virtual void SetState(int env, const PendulumState& state) = 0;

  /// Gives an environment another plant; SetState or loading a state must follow.
  virtual void SetPlant(int env, const Plant& plant) = 0;

  /// Holds `torque` (N), N·m, for one control period and fills `result`, all but `truncated`;
  /// `next_obs` with N packed rows of kObservationSize, even if its rows are wider. Of an
  /// environment whose state has blown up (numbers that are not finite or beyond 1e10, or a warning
  /// of MuJoCo's) only `terminated` is meaningful.
  virtual void Step(std::span<const double> torque, StepResult& result) = 0;

  /// Turns the joints of an environment by these torques, N·m, beside the motor's, from the next
  /// step on until it is told others or gets a state: somebody pushes. Throws Failure if the engine
  /// knows no pushes.
  virtual void Push(int env, const std::array<double, 2>& torque);

  /// Saves or loads the state; plants are not part of it.
  virtual void State(const Archive& archive) = 0;
};

}  // namespace upswing
