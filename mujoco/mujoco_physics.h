#pragma once

#include <array>
#include <vector>

#include "mujoco/model.h"
#include "sim/physics.h"

namespace upswing {

/// N double pendulums in MuJoCo, by its batch interface: one batch for each slice of a few
/// environments, which our thread pool distributes, so that MuJoCo needs no pool of its own. A
/// warning of MuJoCo also counts as a blow-up.
class MuJoCoPhysics : public Physics {
 public:
  /// Throws BadInput on a model that does not compile or is no double pendulum.
  explicit MuJoCoPhysics(const PhysicsConfig& config);

  PendulumState state(int env) const override;
  void SetState(int env, const PendulumState& state) override;
  void SetPlant(int env, const Plant& plant) override;
  void Push(int env, const std::array<double, 2>& torque) override;
  void Step(std::span<const double> torque, StepResult& result) override;
  void State(const Archive& archive) override;

 private:
  /// Consecutive environments, which one thread steps at a time, with MuJoCo's batch of them.
  struct Slice {
    int first, count;
    BatchPtr batch;
    mjtNum *qpos, *qvel, *ctrl, *push;  // in row 0 of the state table
  };
  Slice MakeSlice(const mjModel& model, int first, int count) const;
  const Slice& SliceOf(int env) const { return slices_[static_cast<size_t>(env / slice_size_)]; }
  /// The part of an environment's state that starts at `first` in row 0 of its slice.
  mjtNum* Component(mjtNum* first, int env) const {
    return first + env % slice_size_ * state_size_;
  }
  void StepSlice(const Slice& slice, std::span<const double> torque, StepResult& result);
  bool BlewUp(int env) const;
  void Judge(int env, double torque, StepResult& result) const;

  PhysicsConfig config_;
  int slice_size_;
  std::vector<Slice> slices_;
  bool rotors_ = false, dry_friction_ = false;  // of the model
  int substeps_ = 0;                            // physics steps in a control period
  int state_size_ = 0;                          // numbers in a state row
  std::vector<double> previous_angle_;          // (N) of the motor's joint before the step, rad
};

}  // namespace upswing
