#include "pendulum/pendulum_v1.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace upswing {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kStepSeconds = 0.05;
constexpr int64_t kEpisodeSteps = 200;
constexpr double kMaxVelocity = 8.0;          // rad/s
constexpr double kMaxTorque = 2.0;            // N·m
constexpr double kGoalAngle = 5 * kPi / 180;  // rad

constexpr double kGravity = 10.0;  // m/s²
constexpr double kMass = 1.0;      // kg
constexpr double kLength = 1.0;    // m

EnvSpec Spec() {
  EnvSpec spec;
  spec.task = kPendulumV1;
  spec.obs_size = 3;
  spec.action_limit = {kMaxTorque};
  spec.step_seconds = kStepSeconds;
  spec.term_names = {"angle", "velocity", "effort"};
  spec.state_names = {"theta", "omega"};
  spec.state_units = {"rad", "rad/s"};
  spec.mirror_signs = {1, -1, -1};
  spec.bodies = 1;
  spec.evaluation.seconds = kEpisodeSteps * kStepSeconds;
  spec.evaluation.return_seconds = kEpisodeSteps * kStepSeconds;
  spec.evaluation.solved_return = -160;
  return spec;
}

}  // namespace

PendulumV1::PendulumV1(const GymTaskConfig& config)
    : GymTask(Spec(), {kEpisodeSteps, {kPi, 1}, {kPi, kMaxVelocity}}, config) {
  Begin();
}

void PendulumV1::Lean(int env, std::span<double> lean) const {
  std::array<double, 2> state;
  GetState(env, state);
  lean[0] = state[0];
}

void PendulumV1::Move(Matrix<double> states, std::span<const double> torque,
                      StepResult& result) const {
  constexpr double kGravityTerm = 3 * kGravity / (2 * kLength);      // 1/s²
  constexpr double kTorqueTerm = 3.0 / (kMass * kLength * kLength);  // 1/(kg·m²)
  for (int env = 0; env < states.cols(); ++env) {
    const auto i = static_cast<size_t>(env);
    double &theta = states(0, env), &omega = states(1, env);
    const double u = torque[i];
    result.reward_terms[3 * i] = -theta * theta;
    result.reward_terms[3 * i + 1] = -0.1 * omega * omega;
    result.reward_terms[3 * i + 2] = -0.001 * u * u;

    const double acceleration = kGravityTerm * std::sin(theta) + kTorqueTerm * u;
    omega = std::clamp(omega + acceleration * kStepSeconds, -kMaxVelocity, kMaxVelocity);
    const double turn = omega * kStepSeconds;
    theta += turn;
    if (std::abs(theta) > kPi) theta = std::remainder(theta, 2 * kPi);
    result.work[i] = std::abs(u * turn);
    result.at_goal[i] = std::abs(theta) <= kGoalAngle ? 1 : 0;
    result.terminated[i] = 0;
  }
}

void PendulumV1::Observe(Matrix<const double> states, Matrix<float> obs) const {
  for (int env = 0; env < states.cols(); ++env) {
    const double theta = states(0, env), omega = states(1, env);
    obs(env, 0) = static_cast<float>(std::cos(theta));
    obs(env, 1) = static_cast<float>(std::sin(theta));
    obs(env, 2) = static_cast<float>(omega);
  }
}

}  // namespace upswing
