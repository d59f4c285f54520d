#pragma once

#include <vector>

#include "base/env.h"
#include "base/rng.h"

namespace upswing {

/// A walk on a line, for tests of learners without physics. The observation is the position (one
/// number). The torque moves the position, and the reward is 1 while it is within 0.5 of 0. Leaving
/// ±5 terminates the episode; ten steps truncate it.
class ToyEnv : public VectorEnv {
 public:
  explicit ToyEnv(int num_envs, uint64_t seed = 0)
      : rng_(seed, "toy"), x_(static_cast<size_t>(num_envs)), steps_(x_.size()) {
    spec_ = Spec(num_envs);
    for (float& x : x_) x = Start();
  }
  /// Description of toy environments.
  static EnvSpec Spec(int num_envs) {
    EnvSpec spec;
    spec.task = "toy";
    spec.num_envs = num_envs;
    spec.obs_size = 1;
    spec.action_limit = {1};
    spec.step_seconds = 1;
    spec.term_names = {"near"};
    spec.mirror_signs = {-1};
    spec.evaluation = {20, 10, 10, 0};
    return spec;
  }
  const EnvSpec& spec() const override { return spec_; }
  Matrix<const float> obs() const override { return {x_.data(), num_envs(), 1}; }
  void SetStartNoise(double sigma) override { noise_ = sigma; }
  void SetState(int env, float x) { x_[static_cast<size_t>(env)] = x; }

  void Step(Matrix<const double> action, StepResult& r) override {
    const std::span<const double> torque = action.values();
    for (size_t i = 0; i < x_.size(); ++i) {
      x_[i] += static_cast<float>(torque[i]);
      r.next_obs[i] = poison ? std::numeric_limits<float>::quiet_NaN() : x_[i];
      r.at_goal[i] = std::abs(x_[i]) < 0.5F ? 1 : 0;
      r.reward[i] = r.reward_terms[i] = r.at_goal[i];
      r.torque[i] = torque[i];
      r.work[i] = std::abs(torque[i]);
      r.terminated[i] = std::abs(x_[i]) > 5 ? 1 : 0;
      r.truncated[i] = ++steps_[i] >= episode_steps && !r.terminated[i] ? 1 : 0;
      if (!r.done(i)) continue;
      x_[i] = Start();
      steps_[i] = 0;
    }
  }

  void State(const Archive& archive) override {
    rng_.State(archive.In("rng"));
    archive.Array("x", std::span(x_));
    archive.Array("steps", std::span(steps_), {0, episode_steps - 1});
    archive.Scalar("noise", noise_, {0, 10});
  }

  int64_t episode_steps = 10;
  bool poison = false;  // observations are NaN

 protected:
  EnvSpec spec_;

 private:
  float Start() { return static_cast<float>(noise_ * rng_.Normal()); }

  Rng rng_;
  double noise_ = 1;
  std::vector<float> x_;
  std::vector<int64_t> steps_;
};

}  // namespace upswing
