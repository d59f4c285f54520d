#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "nn/policy.h"
#include "sim/pendulum_env.h"

/// One episode, step by step, as `simulate` writes and `plot` draws it.
namespace upswing {

/// One moment and the torque that is held from then on.
struct RolloutRow {
  double t = 0;  // s
  PendulumState state;
  double torque = 0;  // N·m, within the motor's limit
  double energy = 0;  // J
  double height = 0;  // of the tip, m
  bool inverted = false;
  double reward = 0;  // for the state and the torque, the sum of the terms
  std::array<double, kRewardTerms> terms{};
  std::vector<float> q;  // (A) Q-values of the policy's actions, if asked for
};

struct RolloutConfig {
  const Policy* policy = nullptr;  // who chooses torques; none: the schedule
  std::vector<double> schedule;    // N·m, a torque for each step; 0 behind its end
  Plant plant;
  std::string mjcf;  // another model than the built-in one
  PhysicsEngine physics = PhysicsEngine::kMuJoCo;
  PendulumState start;
  double seconds = 20;  // to the nearest step
  bool q_values = false;
};

/// How many control steps so many seconds are, to the nearest.
int64_t RolloutSteps(double seconds);

/// The states at 0, 0.02, … s, the last one included. Throws Failure if the state blows up.
std::vector<RolloutRow> RunRollout(const RolloutConfig& config);

/// Four numbers q1,q2,w1,w2 (rad, rad/s) as --start gives them. Throws BadInput.
PendulumState ParseStart(const std::string& text);

}  // namespace upswing
