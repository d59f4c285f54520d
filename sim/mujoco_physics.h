#pragma once

#include <vector>

#include "sim/model.h"
#include "sim/physics.h"

namespace upswing {

/// N double pendulums in MuJoCo, on its batch interface. Its own warnings count as a blow-up too.
class MuJoCoPhysics : public Physics {
 public:
  /// Throws BadInput on a model that does not compile or is no double pendulum.
  explicit MuJoCoPhysics(const PhysicsConfig& config);

  PendulumState state(int env) const override;
  void SetState(int env, const PendulumState& state) override;
  void Step(std::span<const double> torque, StepResult& result) override;
  void State(const Archive& archive) override;

 private:
  bool BlewUp(int env) const;
  void Judge(int env, double torque, StepResult& result) const;
  mjtNum* Component(mjtNum* first, int env) const { return first + env * state_size_; }

  PhysicsConfig config_;
  BatchPtr batch_;
  int substeps_ = 0;                                            // physics steps in a control period
  int state_size_ = 0;                                          // numbers in a state row
  mjtNum *qpos_ = nullptr, *qvel_ = nullptr, *ctrl_ = nullptr;  // in row 0 of the state table
  std::vector<double> previous_q1_;                             // (N) before the step
};

}  // namespace upswing
