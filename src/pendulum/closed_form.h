#pragma once

#include <span>

#include "base/aligned.h"
#include "base/env.h"
#include "pendulum/equations.h"
#include "pendulum/scale.h"
#include "pendulum/task_config.h"

/// The double pendulum in closed form, equivalent to the built-in MJCF and vectorised over
/// environments: equations of motion, MuJoCo's Runge-Kutta steps, and the task's observation and
/// reward.
///
/// The results of an environment have the same bits at any index, for any number of environments,
/// and on every path of base/simd.h that has fused multiply-adds.
namespace upswing {

/// N double pendulums: each quantity is an array over the environments. P is N rounded up to whole
/// vectors; the entries beyond N are standard plants at rest.
struct ClosedFormBatch {
  explicit ClosedFormBatch(size_t num_envs);

  size_t padded() const { return q1.size(); }  // P
  /// Computes an environment's constants from its plant.
  void SetPlant(size_t env, const Plant& plant);
  /// Sets the equations of motion of an environment, but not the constants of its task.
  void SetManipulator(size_t env, const Manipulator& manipulator);
  PendulumState state(size_t env) const { return {q1[env], q2[env], w1[env], w2[env]}; }
  void SetState(size_t env, const PendulumState& state);
  /// Sets the motor torques (N), N·m, cut at their limits.
  void SetTorque(std::span<const double> torque);

  using Array = AlignedVector<double>;  // (P)
  // State.
  Array q1, q2, w1, w2;  // rad, rad/s
  Array tau;             // N·m, held until it is set again
  Array angle_before;    // angle of the motor's joint before the last Advance, rad

  // Equations of motion, see Manipulator.
  Array J1, J2, b, a;         // kg·m²
  Array G1, G2;               // N·m
  Array d1, d2;               // N·m·s/rad
  Array f1, f2;               // N·m
  bool dry_friction = false;  // whether any environment has, or has had, dry friction
  Array limit;                // torque limit, N·m
  Array joint;                // the joint that the motor drives: 1 or 2

  Scale scale;  // of observations and penalties, for all environments

  // Constants of the task, from TaskLinksOf.
  Array T1, T2;          // inertias like J1 and J2, without armatures, kg·m²
  Array energy_scale;    // 1 / (2 EnergyTarget), 1/J
  Array share1, share2;  // l1 / (l1 + l2), l2 / (l1 + l2)
};

/// The kernels may split a batch at multiples of this number of environments.
inline constexpr size_t kClosedFormChunk = 48;
/// Number of chunks of kClosedFormChunk in N environments.
inline int ClosedFormChunks(size_t num_envs) {
  return static_cast<int>((num_envs + kClosedFormChunk - 1) / kClosedFormChunk);
}

/// Makes `steps` Runge-Kutta steps of `timestep` seconds with environments `first` to `last`. Both
/// are multiples of kClosedFormChunk, or N.
void Advance(ClosedFormBatch& batch, int steps, size_t first, size_t last,
             double timestep = kPhysicsTimestep);

/// Fills `result`, except `truncated`, from the states with the formulas of Observe, RewardTerms
/// and Inverted. A state that is not finite, or beyond MuJoCo's limit of 1e10, has terminated; its
/// other results have no meaning.
void Judge(const ClosedFormBatch& batch, const RewardConfig& weights, size_t first, size_t last,
           StepResult& result);

}  // namespace upswing
