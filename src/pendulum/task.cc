// Observation, reward and goal. Symbols: see pendulum/task.h. All constants come from the post
// "Balancing a Double Pendulum with DQN and MuJoCo".
#include "pendulum/task.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace upswing {

std::array<Link, 2> TaskLinksOf(const Plant& p) {
  if (p.has_own_links()) return LinksOf(p);
  const auto rod = [](double m, double l) { return Link{m, l, l / 2, m * l * l / 12}; };
  return {rod(p.mass1, p.length1), rod(p.mass2, p.length2)};
}

double Energy(const Plant& plant, const PendulumState& s) {
  const auto links = TaskLinksOf(plant);
  const auto& [m1, l1, c1, I1] = links[0];
  const auto& [m2, l2, c2, I2] = links[1];
  const double g = plant.gravity;
  const double w12 = s.w1 + s.w2;  // absolute velocity of link 2
  const double potential =
      -m1 * g * c1 * std::cos(s.q1) - m2 * g * (l1 * std::cos(s.q1) + c2 * std::cos(s.q1 + s.q2));
  const double v1_squared = c1 * c1 * s.w1 * s.w1;  // of link 1's centre of mass, m²/s²
  const double v2_squared = l1 * l1 * s.w1 * s.w1 + c2 * c2 * w12 * w12 +
                            2 * l1 * c2 * std::cos(s.q2) * s.w1 * w12;  // of link 2's centre
  const double kinetic =
      0.5 * (I1 * s.w1 * s.w1 + I2 * w12 * w12 + m1 * v1_squared + m2 * v2_squared);
  return kinetic + potential;
}

double EnergyTarget(const Plant& plant) {
  const auto [link1, link2] = TaskLinksOf(plant);
  return link1.m * plant.gravity * link1.c + link2.m * plant.gravity * (link1.l + link2.c);
}

double NormalizedEnergy(const Plant& plant, const PendulumState& s) {
  const double target = EnergyTarget(plant);
  return (Energy(plant, s) + target) / (2 * target);
}

double TipHeight(const Plant& plant, const PendulumState& s) {
  return -plant.length1 * std::cos(s.q1) - plant.length2 * std::cos(s.q1 + s.q2);
}

bool Inverted(const PendulumState& s) {
  constexpr double kCos30 = std::numbers::sqrt3 / 2;
  return -std::cos(s.q1) >= kCos30 && -std::cos(s.q1 + s.q2) >= kCos30;
}

std::array<float, kObservationSize> Observe(const Plant& plant, const PendulumState& s,
                                            const Scale& scale) {
  const double height = TipHeight(plant, s) / (plant.length1 + plant.length2);
  const double w1 = s.w1 / (kMaxVelocity1 * scale.velocity());
  const double w2 = s.w2 / (kMaxVelocity2 * scale.velocity());
  const auto f = [](double x) { return static_cast<float>(x); };
  return {f(std::cos(s.q1)),
          f(std::sin(s.q1)),
          f(w1),
          f(std::cos(s.q2)),
          f(std::sin(s.q2)),
          f(w2),
          f(NormalizedEnergy(plant, s)),
          f(height)};
}

std::array<double, kRewardTerms> RewardTerms(const Plant& plant, const PendulumState& s, double tau,
                                             const Scale& scale) {
  const double w1 = s.w1 * scale.time, w2 = s.w2 * scale.time, effort = tau / scale.torque;
  const bool inverted = Inverted(s);
  const double height = TipHeight(plant, s) / (plant.length1 + plant.length2);
  return {
      std::clamp(NormalizedEnergy(plant, s), 0.0, 1.5),  // energy
      (height + 1) / 2,                                  // height
      inverted ? 5.0 : 0.0,                              // balance
      inverted ? -0.01 * (w1 * w1 + w2 * w2) : 0.0,      // velocity
      (inverted ? -0.05 : -0.01) * effort * effort,      // torque
  };
}

}  // namespace upswing
