#include "pendulum/physics.h"

#include <algorithm>

#include "base/error.h"
#include "pendulum/closed_form.h"

namespace upswing {
namespace {

/// N double pendulums in closed form.
class ClosedFormPhysics : public Physics {
 public:
  explicit ClosedFormPhysics(const PhysicsConfig& config)
      : num_envs_(static_cast<size_t>(config.num_envs)),
        weights_(config.reward),
        steps_(config.physics_steps),
        timestep_(config.timestep()),
        batch_(num_envs_),
        pool_(config.pool) {
    batch_.scale = config.scale;
    for (int env = 0; env < config.num_envs; ++env) SetPlant(env, config.plant(env));
  }

  PendulumState state(int env) const override { return batch_.state(static_cast<size_t>(env)); }
  void SetState(int env, const PendulumState& s) override {
    batch_.SetState(static_cast<size_t>(env), s);
  }
  void SetPlant(int env, const Plant& plant) final {
    batch_.SetPlant(static_cast<size_t>(env), plant);
  }

  void Step(std::span<const double> torque, StepResult& result) override {
    batch_.SetTorque(torque);
    // The lambda captures only two references, so std::function needs no allocation.
    ParallelFor(pool_, ClosedFormChunks(num_envs_), [this, &result](int chunk) {
      const size_t first = static_cast<size_t>(chunk) * kClosedFormChunk;
      const size_t last = std::min(first + kClosedFormChunk, num_envs_);
      Advance(batch_, steps_, first, last, timestep_);
      Judge(batch_, weights_, first, last, result);
    });
  }

  void State(const Archive& archive) override {
    archive.Array("q1", std::span(batch_.q1).first(num_envs_));
    archive.Array("q2", std::span(batch_.q2).first(num_envs_));
    archive.Array("w1", std::span(batch_.w1).first(num_envs_));
    archive.Array("w2", std::span(batch_.w2).first(num_envs_));
  }

 private:
  size_t num_envs_;
  RewardConfig weights_;
  int steps_;        // in a control period
  double timestep_;  // s
  ClosedFormBatch batch_;
  ThreadPool* pool_;
};

}  // namespace

const Engine kClosedForm{"closed-form",
                         [](const PhysicsConfig& config) -> std::unique_ptr<Physics> {
                           return std::make_unique<ClosedFormPhysics>(config);
                         }};

std::vector<std::string> EngineNames() { return {kMuJoCoName, kClosedForm.name}; }

void Physics::Push(int /*env*/, const std::array<double, 2>& /*torque*/) {
  throw Failure("physics: expected mujoco, the only engine with pushes, got another");
}

}  // namespace upswing
