#include "control/reward_cost.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace upswing {

double RewardCost::Inversion(const StateVector& x) const {
  const auto rise = [&](double angle) {
    return 1 / (1 + std::exp((std::cos(angle) + std::numbers::sqrt3 / 2) / width_));
  };
  return rise(x[0]) * rise(x[0] + x[1]);
}

double RewardCost::Running(const StateVector& x, double u) const {
  const auto& [energy, height, balance, velocity, torque] = weights_.weight;
  const PendulumState s = StateOf(x);
  const double inverted = Inversion(x);
  const double h = TipHeight(plant_, s) / (plant_.length1 + plant_.length2);
  return energy * (1.5 - std::clamp(NormalizedEnergy(plant_, s), 0.0, 1.5)) + height * (1 - h) / 2 +
         balance * 5 * (1 - inverted) + velocity * 0.01 * inverted * (s.w1 * s.w1 + s.w2 * s.w2) +
         torque * (0.01 + 0.04 * inverted) * u * u;
}

CostExpansion RewardCost::ExpandRunning(const StateVector& x, double u) const {
  // Central differences over the state; the cost is quadratic in the torque.
  constexpr double e = 1e-4;
  CostExpansion l;
  const double here = Running(x, u);
  std::array<double, 4> above, below;
  for (int i = 0; i < 4; ++i) {
    const StateVector step = e * StateVector::Unit(i);
    above[static_cast<size_t>(i)] = Running(x + step, u);
    below[static_cast<size_t>(i)] = Running(x - step, u);
  }
  for (int i = 0; i < 4; ++i) {
    const double a = above[static_cast<size_t>(i)], b = below[static_cast<size_t>(i)];
    l.x[i] = (a - b) / (2 * e);
    l.xx(i, i) = (a - 2 * here + b) / (e * e);
    for (int j = 0; j < i; ++j) {
      const StateVector step = e * (StateVector::Unit(i) + StateVector::Unit(j));
      l.xx(i, j) = l.xx(j, i) = (Running(x + step, u) + Running(x - step, u) + 2 * here - a - b -
                                 above[static_cast<size_t>(j)] - below[static_cast<size_t>(j)]) /
                                (2 * e * e);
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> modes(l.xx);
  const Eigen::Matrix4d& V = modes.eigenvectors();
  l.xx = V * modes.eigenvalues().cwiseMax(0).asDiagonal() * V.transpose();
  l.uu = 2 * weights_.weight[4] * (0.01 + 0.04 * Inversion(x));
  l.u = l.uu * u;
  return l;
}

}  // namespace upswing
