#pragma once

#include <vector>

#include "core/rng.h"
#include "core/vector_env.h"

namespace upswing {

/// A walk on a line, to test learners without physics: the position (one number, the observation)
/// moves by the torque; the reward is 1 while it is within 0.5 of 0. Leaving ±5 terminates, ten
/// steps truncate.
class ToyEnv : public VectorEnv {
 public:
  explicit ToyEnv(int num_envs, uint64_t seed = 0)
      : rng_(seed, "toy"), x_(static_cast<size_t>(num_envs)), steps_(x_.size()) {
    for (float& x : x_) x = Start();
  }
  int num_envs() const override { return static_cast<int>(x_.size()); }
  int obs_size() const override { return 1; }
  std::vector<std::string> reward_term_names() const override { return {"near"}; }
  double step_seconds() const override { return 1; }
  double torque_limit() const override { return 1; }
  std::vector<float> mirror_signs() const override { return {-1}; }
  Matrix<const float> obs() const override { return {x_.data(), num_envs(), 1}; }
  void SetStartNoise(double sigma) override { noise_ = sigma; }

  void Step(std::span<const double> torque, StepResult& r) override {
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

 private:
  float Start() { return static_cast<float>(noise_ * rng_.Normal()); }

  Rng rng_;
  double noise_ = 1;
  std::vector<float> x_;
  std::vector<int64_t> steps_;
};

}  // namespace upswing
