#include "sim/closed_form_physics.h"

#include <algorithm>

#include "core/error.h"

namespace upswing {

const Engine kClosedForm{
    "closed-form", [](const PhysicsConfig& config) -> std::unique_ptr<Physics> {
      if (!config.mjcf.empty()) {
        throw BadInput("physics closed-form: expected the built-in model, got another MJCF model");
      }
      return std::make_unique<ClosedFormPhysics>(config);
    }};

ClosedFormPhysics::ClosedFormPhysics(const PhysicsConfig& config)
    : num_envs_(static_cast<size_t>(config.num_envs)),
      weights_(config.weights),
      batch_(num_envs_),
      pool_(config.pool) {
  for (int env = 0; env < config.num_envs; ++env) {
    batch_.SetPlant(static_cast<size_t>(env), config.plant(env));
  }
}

PendulumState ClosedFormPhysics::state(int env) const {
  return batch_.state(static_cast<size_t>(env));
}

void ClosedFormPhysics::SetState(int env, const PendulumState& s) {
  batch_.SetState(static_cast<size_t>(env), s);
}

void ClosedFormPhysics::SetPlant(int env, const Plant& plant) {
  batch_.SetPlant(static_cast<size_t>(env), plant);
}

void ClosedFormPhysics::Step(std::span<const double> torque, StepResult& result) {
  batch_.SetTorque(torque);
  // Two captured references fit into std::function without an allocation.
  ParallelFor(pool_, ClosedFormChunks(num_envs_), [this, &result](int chunk) {
    const size_t first = static_cast<size_t>(chunk) * kClosedFormChunk;
    const size_t last = std::min(first + kClosedFormChunk, num_envs_);
    Advance(batch_, kPhysicsSteps, first, last);
    Judge(batch_, weights_, first, last, result);
  });
}

void ClosedFormPhysics::State(const Archive& archive) {
  archive.Array("q1", std::span(batch_.q1).first(num_envs_));
  archive.Array("q2", std::span(batch_.q2).first(num_envs_));
  archive.Array("w1", std::span(batch_.w1).first(num_envs_));
  archive.Array("w2", std::span(batch_.w2).first(num_envs_));
}

}  // namespace upswing
