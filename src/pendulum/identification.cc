// Symbols as in pendulum/closed_form.h: J inertias, b coupling of the links (kg·m²), G moments of
// gravity (N·m), d damping (N·m·s/rad); q angles, w velocities, a accelerations, M mass matrix, P
// covariance. "Relative" means an estimate over the nominal plant's value, without unit.
#include "pendulum/identification.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "pendulum/regressor.h"
#include "pendulum/scale.h"
#include "pendulum/timestep.h"

namespace upswing {
namespace {

constexpr double kPriorShare = 0.15;  // about the deviation of a uniform draw within 25%
constexpr double kNoise = 1e-3;       // of a measured change of velocity, rad/s; by Scale::velocity
// Share of the prediction error that counts as noise too: the factors below hold only in the middle
// of the period, and a person may push.
constexpr double kSurprise = 0.3;
// Relative drift of a constant in a control period; it keeps the filter learning.
constexpr double kDrift = 1e-3;
// Limits of the relative estimates, which keep the prediction a pendulum.
constexpr double kLeast = 0.25, kMost = 4;
constexpr double kStrongestCoupling = 0.9;  // of b² / (J1 J2), which is at most 3/4 for thin rods

using Row = std::array<double, kConstants>;

/// Index of P(i, j), i ≤ j, in the upper triangle stored by rows.
constexpr size_t At(int i, int j) {
  return static_cast<size_t>(i * kConstants - i * (i - 1) / 2 + j - i);
}
double Get(std::span<const double> P, int i, int j) { return P[i <= j ? At(i, j) : At(j, i)]; }

/// Kalman filter's update with an equation h·x = y of the relative constants x with covariance P.
/// Standard deviations (rad/s) of y in addition to kSurprise: `noise` of every measurement,
/// `sensor` of the sensors.
void Correct(const Row& h, double y, double noise, double sensor, std::span<double> x,
             std::span<double> P) {
  Row PH{};
  double innovation = y, spread = 0;
  for (int i = 0; i < kConstants; ++i) {
    for (int j = 0; j < kConstants; ++j) PH[i] += Get(P, i, j) * h[j];
    innovation -= h[i] * x[i];
    spread += h[i] * PH[i];
  }
  const double surprise = kSurprise * innovation;
  const double S = spread + noise * noise + sensor * sensor + surprise * surprise;
  for (int i = 0; i < kConstants; ++i) {
    x[i] += PH[i] / S * innovation;
    for (int j = i; j < kConstants; ++j) P[At(i, j)] -= PH[i] * PH[j] / S;
  }
}

/// The equations of both joints in the middle of a control period: factors of the identified
/// constants.
struct MiddleEquations {
  Row one, two;
  double c2;  // cos q2

  MiddleEquations(const PendulumState& from, const PendulumState& to, double period) {
    const dynamics::JointPair<double> w{(from.w1 + to.w1) / 2, (from.w2 + to.w2) / 2};
    const auto angles =
        dynamics::AnglesOf<double>({from.q1 + period / 2 * w.one, from.q2 + period / 2 * w.two});
    c2 = angles.c2;
    const Factors factors =
        Regressor(angles, w, {(to.w1 - from.w1) / period, (to.w2 - from.w2) / period});
    constexpr std::array<size_t, kConstants> kColumns{column::kJ1, column::kJ2, column::kB,
                                                      column::kG1, column::kG2, column::kD1,
                                                      column::kD2};  // of kIdentified
    for (size_t k = 0; k < kColumns.size(); ++k) {
      one[k] = factors[0][kColumns[k]];
      two[k] = factors[1][kColumns[k]];
    }
  }
};

}  // namespace

const std::array<float, kIdentifiedSize> kIdentifiedMirrorSigns{1, 1, 1, 1,  1,  1, 1,
                                                                1, 1, 1, -1, -1, -1};

Identifier::Identifier(const Plant& nominal, double control_period, int num_envs)
    : plant_(nominal),
      period_(control_period),
      physics_steps_(PhysicsStepsFor(nominal, control_period, "nominal plant")),
      noise_(kNoise * TaskScaleOf(nominal).velocity()),
      nominal_(ManipulatorOf(nominal)),
      prior_{},
      relative_(static_cast<size_t>(num_envs) * kConstants, 1.0),
      covariance_(static_cast<size_t>(num_envs) * kCovariance),
      last_(static_cast<size_t>(num_envs) * 4),
      prediction_(1) {
  prediction_.SetPlant(0, nominal);
  // Share of each parameter in the constants, by differences.
  for (double Plant::*parameter :
       {&Plant::mass1, &Plant::mass2, &Plant::length1, &Plant::length2, &Plant::damping1,
        &Plant::damping2, &Plant::gravity, &Plant::center1, &Plant::center2, &Plant::inertia1,
        &Plant::inertia2}) {
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
  prediction_.SetState(0, from);
  prediction_.tau[0] = torque;
  Advance(prediction_, physics_steps_, 0, 1, period_ / physics_steps_);
  return prediction_.state(0);
}

void Identifier::Update(int env, double torque, const PendulumState& measured, double noise) {
  const auto i = static_cast<size_t>(env);
  const PendulumState before = Replace(env, measured);
  const auto x = std::span(relative_).subspan(i * kConstants, kConstants);
  const auto P = std::span(covariance_).subspan(i * kCovariance, kCovariance);
  const Manipulator estimated = estimate(env);
  const PendulumState predicted = Predict(estimated, torque, before);

  // True constants θ satisfy Φ θ = τ. Estimated ones leave the residual Φ θ' - τ, and so a wrong
  // acceleration: M⁻¹ (Φ θ' - τ) h is the measured minus the predicted change. The prediction is
  // exact; Φ as its derivative is nearly so.
  MiddleEquations equations(before, measured, period_);
  const MassMatrix M = estimated.Mass(equations.c2);
  const double scale = -period_ / M.det;
  for (size_t k = 0; k < x.size(); ++k) {
    const double usual = nominal_.*kIdentified[k];
    const double f1 = equations.one[k] * usual, f2 = equations.two[k] * usual;
    equations.one[k] = scale * (M.M22 * f1 - M.M12 * f2);
    equations.two[k] = scale * (M.M11 * f2 - M.M12 * f1);
  }
  const auto at = [&](const Row& h) {
    return std::inner_product(x.begin(), x.end(), h.begin(), 0.0);
  };
  const double y1 = measured.w1 - predicted.w1 + at(equations.one);
  const double y2 = measured.w2 - predicted.w2 + at(equations.two);
  for (int k = 0; k < kConstants; ++k) {
    if (nominal_.*kIdentified[static_cast<size_t>(k)] > 0) P[At(k, k)] += kDrift * kDrift;
  }
  Correct(equations.one, y1, noise_, noise, x, P);
  Correct(equations.two, y2, noise_, noise, x, P);
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
  // A mode that the motor cannot reach now has infinite numbers.
  const auto add = [&](double x) {
    numbers[at++] = std::isfinite(x) ? static_cast<float>(x) : 0.0F;
  };
  for (size_t k = 0; k < kConstants; ++k) add((relative_[i * kConstants + k] - 1) / kConstantScale);

  const Falling falling = FallingOf(plant, plant_, s);
  add(std::clamp(falling.delta, -1.0, 1.0));
  add(std::tanh(0.1 / falling.delta));
  add(plant.At(s).energy / (2 * (plant.G1 + plant.G2)) + 1);
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
