#pragma once

#include "sim/closed_form.h"
#include "sim/physics.h"

namespace upswing {

/// N double pendulums in closed form.
class ClosedFormPhysics : public Physics {
 public:
  explicit ClosedFormPhysics(const PhysicsConfig& config);

  PendulumState state(int env) const override;
  void SetState(int env, const PendulumState& state) override;
  void SetPlant(int env, const Plant& plant) override;
  void Step(std::span<const double> torque, StepResult& result) override;
  void State(const Archive& archive) override;

 private:
  size_t num_envs_;
  RewardWeights weights_;
  ClosedFormBatch batch_;
  ThreadPool* pool_;
};

}  // namespace upswing
