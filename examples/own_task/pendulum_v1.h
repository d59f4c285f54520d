#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "base/env.h"
#include "base/rng.h"

/// N environments of Gymnasium's Pendulum-v1: a motor swings up a rod that it is too weak to lift
/// in one go, and balances it. https://gymnasium.farama.org/environments/classic_control/pendulum/
///
/// State: angle theta in [-π, π] rad, 0 upright; velocity omega within ±8 rad/s. Observation:
/// cos theta, sin theta, omega. Action: torque u within ±2 N·m. A step of dt = 0.05 s, with
/// g = 10 m/s², m = 1 kg, l = 1 m:
///   omega' = clip(omega + (3 g / (2 l) sin theta + 3 / (m l²) u) dt, ±8)
///   theta' = theta + omega' dt
/// Reward, of the state before the step: angle -theta², velocity -0.1 omega², effort -0.001 u².
///
/// An episode begins with theta uniform within ±π and omega uniform within ±1. It is truncated
/// after 200 steps. The goal is to be within 5° of upright. Gymnasium has no threshold of the
/// return; here a mean of -160 solves the task.
class PendulumV1 final : public upswing::VectorEnv {
 public:
  PendulumV1(int num_envs, uint64_t seed)
      : rng_(seed, "Pendulum-v1"), rods_(size_t(num_envs)), obs_(3 * rods_.size()) {
    constexpr double kSeconds = kEpisodeSteps * kStep;
    spec_.task = "Pendulum-v1";
    spec_.num_envs = num_envs;
    spec_.obs_size = 3;
    spec_.action_limit = {kMaxTorque};
    spec_.step_seconds = kStep;
    spec_.term_names = {"angle", "velocity", "effort"};
    spec_.mirror_signs = {1, -1, -1};  // left-right symmetry
    spec_.evaluation = {.seconds = kSeconds, .return_seconds = kSeconds, .solved_return = -160};
    for (int i = 0; i < num_envs; ++i) Reset(i);
  }

  const upswing::EnvSpec& spec() const override { return spec_; }
  upswing::Matrix<const float> obs() const override { return {obs_.data(), num_envs(), 3}; }

  void Step(upswing::Matrix<const double> action, upswing::StepResult& r) override {
    for (int i = 0; i < num_envs(); ++i) {
      auto& [theta, omega, steps] = rods_[size_t(i)];
      const double u = std::clamp(action(i, 0), -kMaxTorque, kMaxTorque);
      const double terms[] = {-theta * theta, -0.1 * omega * omega, -0.001 * u * u};
      omega = std::clamp(omega + (15 * std::sin(theta) + 3 * u) * kStep, -kMaxOmega, kMaxOmega);
      theta = std::remainder(theta + omega * kStep, 2 * kPi);
      ++steps;

      std::ranges::copy(terms, r.reward_terms.begin() + 3 * i);
      r.reward[size_t(i)] = terms[0] + terms[1] + terms[2];
      r.torque[size_t(i)] = u;
      r.work[size_t(i)] = std::abs(u * omega * kStep);
      r.at_goal[size_t(i)] = std::abs(theta) < kPi / 36;
      r.terminated[size_t(i)] = false;
      r.truncated[size_t(i)] = steps == kEpisodeSteps;
      Show(i);
      std::copy_n(obs_.begin() + 3 * i, 3, r.next_obs.begin() + 3 * i);  // before the reset
      if (r.done(size_t(i))) Reset(i);
    }
  }

  void State(const upswing::Archive& archive) override {
    rng_.State(archive.In("rng"));
    for (int i = 0; i < num_envs(); ++i) {
      const upswing::Archive a = archive.In(std::to_string(i));
      Rod& rod = rods_[size_t(i)];
      a.Scalar("theta", rod.theta, {-kPi, kPi});
      a.Scalar("omega", rod.omega, {-kMaxOmega, kMaxOmega});
      a.Scalar("steps", rod.steps, {0, kEpisodeSteps - 1});
      Show(i);
    }
  }

 private:
  static constexpr double kPi = std::numbers::pi;
  static constexpr double kStep = 0.05;      // s; a torque is held for this time
  static constexpr int kEpisodeSteps = 200;  // 10 s
  static constexpr double kMaxTorque = 2;    // N·m
  static constexpr double kMaxOmega = 8;     // rad/s

  struct Rod {
    double theta = 0, omega = 0;
    int64_t steps = 0;
  };

  void Reset(int i) {
    const double theta = rng_.Uniform(-kPi, kPi);
    rods_[size_t(i)] = {theta, rng_.Uniform(-1, 1), 0};
    Show(i);
  }
  void Show(int i) {
    const Rod& rod = rods_[size_t(i)];
    obs_[3 * size_t(i)] = float(std::cos(rod.theta));
    obs_[3 * size_t(i) + 1] = float(std::sin(rod.theta));
    obs_[3 * size_t(i) + 2] = float(rod.omega);
  }

  upswing::EnvSpec spec_;
  upswing::Rng rng_;
  std::vector<Rod> rods_;   // (N)
  std::vector<float> obs_;  // (N, 3)
};
