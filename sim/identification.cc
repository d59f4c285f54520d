// Symbols as in sim/closed_form.h: J inertias, b coupling of the links (kg·m²), G moments of
// gravity (N·m), d damping (N·m·s/rad); q angles, w velocities, a accelerations, M mass matrix,
// P covariance. "Relative" is an estimate over the nominal plant's, without unit.
#include "sim/identification.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "sim/closed_form.h"

namespace upswing {
namespace {

constexpr double kPriorShare = 0.15;  // about the deviation of what is uniform within 25%
constexpr double kNoise = 1e-3;       // rad/s, of a measured change of velocity
// Share of what was not predicted that counts as noise too: the factors below are those of the
// middle of the period, and somebody may push.
constexpr double kSurprise = 0.3;
// What a constant may drift in a control period, relative: the filter never stops learning.
constexpr double kDrift = 1e-3;
// Estimates stay within these limits, so that the prediction remains a pendulum.
constexpr double kLeast = 0.25, kMost = 4;
constexpr double kStrongestCoupling = 0.9;  // b² / (J1 J2): thin rods have at most 3/4

using Row = std::array<double, kConstants>;

/// Index of P(i, j), i ≤ j, in the rows of its upper triangle.
constexpr size_t At(int i, int j) {
  return static_cast<size_t>(i * kConstants - i * (i - 1) / 2 + j - i);
}
double Get(std::span<const double> P, int i, int j) { return P[i <= j ? At(i, j) : At(j, i)]; }

/// Takes in an equation h·x = y of the relative constants x with covariance P: a Kalman filter's
/// update.
void Correct(const Row& h, double y, std::span<double> x, std::span<double> P) {
  Row PH{};
  double innovation = y, spread = 0;
  for (int i = 0; i < kConstants; ++i) {
    for (int j = 0; j < kConstants; ++j) PH[i] += Get(P, i, j) * h[j];
    innovation -= h[i] * x[i];
    spread += h[i] * PH[i];
  }
  const double surprise = kSurprise * innovation;
  const double S = spread + kNoise * kNoise + surprise * surprise;
  for (int i = 0; i < kConstants; ++i) {
    x[i] += PH[i] / S * innovation;
    for (int j = i; j < kConstants; ++j) P[At(i, j)] -= PH[i] * PH[j] / S;
  }
}

/// M q̈ + c + g + d q̇ is linear in the constants: their factors for both joints, in the middle of a
/// control period.
struct Factors {
  Row one, two;
  double c2;  // cos q2

  Factors(const PendulumState& from, const PendulumState& to) {
    const double a1 = (to.w1 - from.w1) / kControlPeriod, a2 = (to.w2 - from.w2) / kControlPeriod;
    const double w1 = (from.w1 + to.w1) / 2, w2 = (from.w2 + to.w2) / 2;
    const double q1 = from.q1 + kControlPeriod / 2 * w1, q2 = from.q2 + kControlPeriod / 2 * w2;
    const double s1 = std::sin(q1), s2 = std::sin(q2), s12 = std::sin(q1 + q2);
    c2 = std::cos(q2);
    one = {a1, a1 + a2, c2 * (2 * a1 + a2) - s2 * (2 * w1 + w2) * w2, s1, s12, w1, 0};
    two = {0, a1 + a2, c2 * a1 + s2 * w1 * w1, 0, s12, 0, w2};
  }
};

}  // namespace

const std::array<float, kIdentifiedSize> kIdentifiedMirrorSigns{1, 1, 1, 1,  1,  1, 1,
                                                                1, 1, 1, -1, -1, -1};

PassiveJoint PassiveJointOf(const Manipulator& plant, int actuated_joint) {
  const auto& [J1, J2, b, a, G1, G2, d1, d2, f1, f2] = plant;
  const auto growth = [](double inertia, double damping, double gravity) {
    return (std::sqrt(damping * damping + 4 * inertia * gravity) - damping) / (2 * inertia);
  };
  if (actuated_joint == 2) {
    // Of joint 1, under no torque: M11 q̈1 + d1 q̇1 - (G1 + G2) q1 = -(M12 q̈2 - G2 q2). Both sides
    // are 0 for one rate where pole and zero are the same: then no torque reaches that mode.
    const double pole = growth(J1 + J2 + 2 * b, d1, G1 + G2), zero = std::sqrt(G2 / (J2 + b));
    return {pole, (zero - pole) / (zero + pole)};
  }
  // Of link 2 in absolute angles φ1, φ2: n12 φ̈1 + n22 φ̈2 + d2 (φ̇2 - φ̇1) = G2 φ2. Its zero is
  // z = d2 / n12, by which delta is widened: n12 may be 0.
  const double n12 = b - a, pole = growth(J2 + a, d2, G2);
  return {pole, (d2 - pole * n12) / (d2 + pole * n12)};
}

Falling FallingOf(const Manipulator& plant, const Plant& motor, const PendulumState& s) {
  const bool at_joint1 = motor.actuated_joint == 1;
  const double G1 = plant.G1, G2 = plant.G2, d1 = plant.d1, d2 = plant.d2;
  const auto [M11, M12, M22] = plant.Mass(1);
  // K(λ) = M λ² + D λ - G about upright; K(λ) y = 0 for a mode of rate λ. Its determinant is
  // k4 λ⁴ + k3 λ³ + k2 λ² + k1 λ + k0.
  const double G = G1 + G2;
  const double k4 = M11 * M22 - M12 * M12, k3 = M11 * d2 + M22 * d1;
  const double k2 = d1 * d2 - M11 * G2 - M22 * G + 2 * M12 * G2;
  const double k1 = -d1 * G2 - d2 * G, k0 = G1 * G2;

  // The roots are real, two above 0. From above Newton's method falls to the largest one, and on
  // the cubic without that to the next.
  const auto newton = [](double x, double c4, double c3, double c2, double c1, double c0) {
    for (int i = 0; i < 50; ++i) {
      const double value = (((c4 * x + c3) * x + c2) * x + c1) * x + c0;
      const double slope = ((4 * c4 * x + 3 * c3) * x + 2 * c2) * x + c1;
      const double step = value / slope;
      x -= step;
      if (!(std::abs(step) > 1e-12 * x)) break;
    }
    return x;
  };
  Falling falling;
  // Without damping λ² are the roots of a quadratic; damping makes each smaller.
  const double undamped = -M11 * G2 - M22 * G + 2 * M12 * G2;
  const double start =
      std::sqrt((-undamped + std::sqrt(undamped * undamped - 4 * k4 * k0)) / (2 * k4));
  const double fast = newton(start, k4, k3, k2, k1, k0);
  // Division by (λ - fast): c3 λ³ + c2 λ² + c1 λ + c0
  const double c3 = k4, c2 = k3 + fast * c3, c1 = k2 + fast * c2, c0 = k1 + fast * c1;
  const double slow = newton(fast, 0, c3, c2, c1, c0);
  falling.rate = {fast, slow};

  // z = y' (M w + (M λ + D) q) grows as ż = λ z + y1 u, or y2 u of a motor at joint 2.
  const auto lean = Lean(s);
  const double q1 = lean[0], q2 = lean[1] - lean[0];
  for (size_t i = 0; i < 2; ++i) {
    const double rate = falling.rate[i];
    const double K11 = (M11 * rate + d1) * rate - G, K12 = M12 * rate * rate - G2;
    const double K22 = (M22 * rate + d2) * rate - G2;
    const bool first = std::abs(K11) > std::abs(K22);
    const double y1 = first ? -K12 : K22, y2 = first ? K11 : -K12;
    const double z = y1 * (M11 * s.w1 + M12 * s.w2 + (M11 * rate + d1) * q1 + M12 * rate * q2) +
                     y2 * (M12 * s.w1 + M22 * s.w2 + M12 * rate * q1 + (M22 * rate + d2) * q2);
    falling.zeta[i] = rate * z / ((at_joint1 ? y1 : y2) * motor.torque_limit);
  }
  // The gain that places both poles at their mirror images: Anderson, Moore, section 4.3.
  falling.torque = -2 * (fast + slow) / (fast - slow) * (falling.zeta[0] - falling.zeta[1]);

  falling.delta = PassiveJointOf(plant, static_cast<int>(motor.actuated_joint)).delta;
  return falling;
}

Identifier::Identifier(const Plant& nominal, int num_envs)
    : plant_(nominal),
      nominal_(ManipulatorOf(nominal)),
      prior_{},
      relative_(static_cast<size_t>(num_envs) * kConstants, 1.0),
      covariance_(static_cast<size_t>(num_envs) * kCovariance),
      last_(static_cast<size_t>(num_envs) * 4),
      prediction_(1) {
  prediction_.SetPlant(0, nominal);
  // Each parameter's share by differences.
  for (double Plant::*parameter : {&Plant::mass1, &Plant::mass2, &Plant::length1, &Plant::length2,
                                   &Plant::damping1, &Plant::damping2, &Plant::gravity}) {
    constexpr double kStep = 1e-3;
    Plant more = nominal, less = nominal;
    more.*parameter *= 1 + kStep;
    less.*parameter *= 1 - kStep;
    const Manipulator high = ManipulatorOf(more), low = ManipulatorOf(less);
    Row change{};
    for (size_t k = 0; k < change.size(); ++k) {
      const auto constant = kIdentified[k];
      const double usual = nominal_.*constant;
      if (usual > 0) {
        change[k] = kPriorShare * (high.*constant - low.*constant) / (2 * kStep * usual);
      }
    }
    for (int i = 0; i < kConstants; ++i) {
      for (int j = i; j < kConstants; ++j) prior_[At(i, j)] += change[i] * change[j];
    }
  }
}

void Identifier::Begin(int env, const PendulumState& measured) {
  std::fill_n(relative_.begin() + static_cast<ptrdiff_t>(env) * kConstants, kConstants, 1.0);
  std::ranges::copy(prior_, covariance_.begin() + static_cast<ptrdiff_t>(env) * kCovariance);
  Replace(env, measured);
}

PendulumState Identifier::Replace(int env, const PendulumState& measured) {
  const auto last = std::span(last_).subspan(static_cast<size_t>(env) * 4, 4);
  const PendulumState before{last[0], last[1], last[2], last[3]};
  std::ranges::copy(std::array{measured.q1, measured.q2, measured.w1, measured.w2}, last.begin());
  return before;
}

Manipulator Identifier::estimate(int env) const {
  Manipulator plant = nominal_;
  for (size_t k = 0; k < kConstants; ++k) {
    plant.*kIdentified[k] *= relative_[static_cast<size_t>(env) * kConstants + k];
  }
  return plant;
}

PendulumState Identifier::Predict(const Manipulator& plant, double torque,
                                  const PendulumState& from) {
  prediction_.SetManipulator(0, plant);
  prediction_.q1[0] = from.q1;
  prediction_.q2[0] = from.q2;
  prediction_.w1[0] = from.w1;
  prediction_.w2[0] = from.w2;
  prediction_.tau[0] = torque;
  Advance(prediction_, kPhysicsSteps, 0, 1);
  return {prediction_.q1[0], prediction_.q2[0], prediction_.w1[0], prediction_.w2[0]};
}

void Identifier::Update(int env, double torque, const PendulumState& measured) {
  const auto i = static_cast<size_t>(env);
  const PendulumState before = Replace(env, measured);
  const auto x = std::span(relative_).subspan(i * kConstants, kConstants);
  const auto P = std::span(covariance_).subspan(i * kCovariance, kCovariance);
  const Manipulator estimated = estimate(env);
  const PendulumState predicted = Predict(estimated, torque, before);

  // With Φ θ = τ for the true constants θ, the estimated ones leave Φ θ' - τ, by which they miss
  // the acceleration: M⁻¹ (Φ θ' - τ) h is what was measured less what was predicted. As a
  // prediction it is exact, as a derivative Φ is nearly so.
  Factors factors(before, measured);
  const MassMatrix M = estimated.Mass(factors.c2);
  const double scale = -kControlPeriod / M.det();
  for (size_t k = 0; k < x.size(); ++k) {
    const double usual = nominal_.*kIdentified[k];
    const double f1 = factors.one[k] * usual, f2 = factors.two[k] * usual;
    factors.one[k] = scale * (M.M22 * f1 - M.M12 * f2);
    factors.two[k] = scale * (M.M11 * f2 - M.M12 * f1);
  }
  const auto at = [&](const Row& h) {
    return std::inner_product(x.begin(), x.end(), h.begin(), 0.0);
  };
  const double y1 = measured.w1 - predicted.w1 + at(factors.one);
  const double y2 = measured.w2 - predicted.w2 + at(factors.two);
  for (int k = 0; k < kConstants; ++k) {
    if (nominal_.*kIdentified[static_cast<size_t>(k)] > 0) P[At(k, k)] += kDrift * kDrift;
  }
  Correct(factors.one, y1, x, P);
  Correct(factors.two, y2, x, P);
  for (double& share : x) share = std::clamp(share, kLeast, kMost);
  const Manipulator now = estimate(env);
  constexpr size_t kB = 2;
  const double most = std::sqrt(kStrongestCoupling * now.J1 * now.J2);
  x[kB] = std::min(x[kB], most / nominal_.b);
}

void Identifier::Observe(int env, const PendulumState& s, std::span<float> numbers) const {
  const auto i = static_cast<size_t>(env);
  const Manipulator plant = estimate(env);
  size_t at = 0;
  // Where a mode is out of the motor's reach just now, its numbers are without a limit.
  const auto add = [&](double x) {
    numbers[at++] = std::isfinite(x) ? static_cast<float>(x) : 0.0F;
  };
  for (size_t k = 0; k < kConstants; ++k) add((relative_[i * kConstants + k] - 1) / kConstantScale);

  const Falling falling = FallingOf(plant, plant_, s);
  add(std::clamp(falling.delta, -1.0, 1.0));
  add(std::tanh(0.1 / falling.delta));
  const double w12 = s.w1 + s.w2;
  const double kinetic =
      0.5 * (plant.J1 * s.w1 * s.w1 + plant.J2 * w12 * w12 + plant.a * s.w2 * s.w2) +
      plant.b * std::cos(s.q2) * s.w1 * w12;
  const double potential = -plant.G1 * std::cos(s.q1) - plant.G2 * std::cos(s.q1 + s.q2);
  add((kinetic + potential) / (2 * (plant.G1 + plant.G2)) + 0.5);
  for (const double zeta : falling.zeta) add(zeta / (1 + std::abs(zeta)));
  add(std::clamp(falling.torque, -1.0, 1.0));
}

void Identifier::State(const Archive& archive) {
  archive.Array("relative", std::span(relative_), {kLeast, kMost});
  archive.Array("covariance", std::span(covariance_));
  for (size_t first = 0; first < covariance_.size(); first += kCovariance) {
    for (int k = 0; k < kConstants; ++k) {
      archive.Check(covariance_[first + At(k, k)] >= 0, "covariance", "variances of at least 0");
    }
  }
  archive.Array("last", std::span(last_));
}

}  // namespace upswing
