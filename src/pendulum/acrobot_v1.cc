#include "pendulum/acrobot_v1.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace upswing {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kStepSeconds = 0.2;
constexpr int64_t kEpisodeSteps = 500;
constexpr double kMaxOmega1 = 4 * kPi, kMaxOmega2 = 9 * kPi;  // rad/s
constexpr double kMaxTorque = 1.0;                            // N·m
constexpr double kGoalHeight = 1.0;  // height of the free end above the first joint, m

EnvSpec Spec() {
  EnvSpec spec;
  spec.task = kAcrobotV1;
  spec.obs_size = 6;
  spec.action_limit = {kMaxTorque};
  spec.step_seconds = kStepSeconds;
  spec.term_names = {"time"};
  spec.state_names = {"theta1", "theta2", "omega1", "omega2"};
  spec.state_units = {"rad", "rad", "rad/s", "rad/s"};
  spec.mirror_signs = {1, -1, 1, -1, -1, -1};
  spec.evaluation.seconds = kEpisodeSteps * kStepSeconds;
  spec.evaluation.return_seconds = kEpisodeSteps * kStepSeconds;
  spec.evaluation.solved_return = -100;
  return spec;
}

/// The four state variables, or their time derivatives.
struct Variables {
  double theta1, theta2, omega1, omega2;
};

/// a + factor · b
Variables Sum(const Variables& a, double factor, const Variables& b) {
  return {a.theta1 + factor * b.theta1, a.theta2 + factor * b.theta2, a.omega1 + factor * b.omega1,
          a.omega2 + factor * b.omega2};
}

/// ds/dt by the equations of Sutton and Barto. Symbols: m mass (kg), l length (m), lc distance from
/// the joint to the centre of mass (m), I moment of inertia (kg·m²), g gravity (m/s²), tau torque
/// (N·m).
Variables Derivative(const Variables& s, double tau) {
  constexpr double m1 = 1, m2 = 1, l1 = 1, lc1 = 0.5, lc2 = 0.5, I1 = 1, I2 = 1, g = 9.8;
  const double sin2 = std::sin(s.theta2), cos2 = std::cos(s.theta2);
  const double w1 = s.omega1, w2 = s.omega2;

  // The book's cos(x - π/2) is sin x.
  const double d1 = m1 * lc1 * lc1 + m2 * (l1 * l1 + lc2 * lc2 + 2 * l1 * lc2 * cos2) + I1 + I2;
  const double d2 = m2 * (lc2 * lc2 + l1 * lc2 * cos2) + I2;
  const double phi2 = m2 * lc2 * g * std::sin(s.theta1 + s.theta2);
  const double phi1 = -m2 * l1 * lc2 * w2 * w2 * sin2 - 2 * m2 * l1 * lc2 * w2 * w1 * sin2 +
                      (m1 * lc1 + m2 * l1) * g * std::sin(s.theta1) + phi2;
  const double a2 = (tau + d2 / d1 * phi1 - m2 * l1 * lc2 * w1 * w1 * sin2 - phi2) /
                    (m2 * lc2 * lc2 + I2 - d2 * d2 / d1);
  const double a1 = -(d2 * a2 + phi1) / d1;
  return {w1, w2, a1, a2};
}

/// One classical Runge-Kutta step over h seconds.
Variables RungeKutta(const Variables& s, double tau, double h) {
  const Variables k1 = Derivative(s, tau);
  const Variables k2 = Derivative(Sum(s, h / 2, k1), tau);
  const Variables k3 = Derivative(Sum(s, h / 2, k2), tau);
  const Variables k4 = Derivative(Sum(s, h, k3), tau);
  const Variables slope = Sum(Sum(Sum(k1, 2, k2), 2, k3), 1, k4);
  return Sum(s, h / 6, slope);
}

}  // namespace

AcrobotV1::AcrobotV1(const GymTaskConfig& config)
    : GymTask(Spec(), {kEpisodeSteps, {0.1, 0.1, 0.1, 0.1}, {kPi, kPi, kMaxOmega1, kMaxOmega2}},
              config) {
  Begin();
}

void AcrobotV1::Move(Matrix<double> states, std::span<const double> torque,
                     StepResult& result) const {
  for (int env = 0; env < states.cols(); ++env) {
    const auto i = static_cast<size_t>(env);
    const Variables s{states(0, env), states(1, env), states(2, env), states(3, env)};
    const Variables next = RungeKutta(s, torque[i], kStepSeconds);
    states(0, env) = std::remainder(next.theta1, 2 * kPi);
    states(1, env) = std::remainder(next.theta2, 2 * kPi);
    states(2, env) = std::clamp(next.omega1, -kMaxOmega1, kMaxOmega1);
    states(3, env) = std::clamp(next.omega2, -kMaxOmega2, kMaxOmega2);

    const double height = -std::cos(states(0, env)) - std::cos(states(0, env) + states(1, env));
    const bool at_goal = height > kGoalHeight;
    result.reward_terms[i] = at_goal ? 0 : -1;
    result.work[i] = std::abs(torque[i] * (next.theta2 - s.theta2));
    result.at_goal[i] = result.terminated[i] = at_goal ? 1 : 0;
  }
}

void AcrobotV1::Observe(Matrix<const double> states, Matrix<float> obs) const {
  for (int env = 0; env < states.cols(); ++env) {
    obs(env, 0) = static_cast<float>(std::cos(states(0, env)));
    obs(env, 1) = static_cast<float>(std::sin(states(0, env)));
    obs(env, 2) = static_cast<float>(std::cos(states(1, env)));
    obs(env, 3) = static_cast<float>(std::sin(states(1, env)));
    obs(env, 4) = static_cast<float>(states(2, env));
    obs(env, 5) = static_cast<float>(states(3, env));
  }
}

}  // namespace upswing
