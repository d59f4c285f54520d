// Symbols as in the paper: l cost, V smallest cost to come, Q cost of a step plus the cost to come;
// a subscript is a derivative. k and K change the torque to u + k + K (x̂ - x).
#include "control/trajectory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "control/controller.h"

namespace upswing {
namespace {

/// Regularisation: smallest, first and largest value, and the factor of a change.
constexpr double kLeast = 1e-6, kFirst = 1e-3, kLargest = 1e10, kFactor = 4;

double Form(const Eigen::Matrix4d& Q, const StateVector& x) { return x.dot(Q * x); }

}  // namespace

QuadraticCost::QuadraticCost(const Eigen::Matrix4d& Q, double R, const Eigen::Matrix4d& P,
                             double angle_range)
    : Q_(Q), R_(R), P_(P) {
  // Upright, q1 is an odd multiple of π, and q2 a multiple of 2π.
  constexpr double kTurn = 2 * std::numbers::pi;
  largest_upright1_ = (std::floor(angle_range / kTurn - 0.5) + 0.5) * kTurn;
  largest_upright2_ = std::floor(angle_range / kTurn) * kTurn;
}

StateVector QuadraticCost::Deviation(const StateVector& x) const {
  StateVector d = UprightDeviation(x);
  // Move the goal into the range.
  const double upright1 = x[0] - d[0], upright2 = x[1] - d[1];
  d[0] += upright1 - std::clamp(upright1, -largest_upright1_, largest_upright1_);
  d[1] += upright2 - std::clamp(upright2, -largest_upright2_, largest_upright2_);
  return d;
}

double QuadraticCost::Running(const StateVector& x, double u) const {
  return Form(Q_, Deviation(x)) + R_ * u * u;
}

double QuadraticCost::Final(const StateVector& x) const { return Form(P_, Deviation(x)); }

CostExpansion QuadraticCost::ExpandRunning(const StateVector& x, double u) const {
  CostExpansion l;
  l.x = 2 * Q_ * Deviation(x);
  l.u = 2 * R_ * u;
  l.xx = 2 * Q_;
  l.uu = 2 * R_;
  return l;
}

CostExpansion QuadraticCost::ExpandFinal(const StateVector& x) const {
  CostExpansion l;
  l.x = 2 * P_ * Deviation(x);
  l.xx = 2 * P_;
  return l;
}

Trajectory TrajectoryOptimizer::Follow(const QuadraticCost& cost, const StateVector& start,
                                       const std::vector<double>& torques) {
  const auto planned = [&](size_t, size_t t, const StateVector&) { return torques[t]; };
  return std::move(Follow(cost, start, 1, torques.size(), planned).front());
}

std::vector<Trajectory> TrajectoryOptimizer::Follow(const QuadraticCost& cost,
                                                    const StateVector& start,
                                                    std::span<const FeedbackPlan> plans) {
  const size_t T = plans.empty() ? 0 : plans[0].planned.u.size();
  return Follow(cost, start, plans.size(), T, [&](size_t i, size_t t, const StateVector& x) {
    const auto& [planned, K] = plans[i];
    return planned.u[t] + K[t].dot(x - planned.x[t]);
  });
}

std::vector<Trajectory> TrajectoryOptimizer::Follow(const QuadraticCost& cost,
                                                    const StateVector& start, size_t n,
                                                    size_t steps, const Torque& torque) {
  const double limit = model_.plant().torque_limit;
  std::vector<Trajectory> results(n);
  std::vector<StateVector> x(n, start);
  std::vector<double> u(n);
  for (Trajectory& result : results) {
    result.x.reserve(steps + 1);
    result.u.reserve(steps);
    result.x.push_back(start);
  }
  for (size_t t = 0; t < steps; ++t) {
    for (size_t i = 0; i < n; ++i) u[i] = std::clamp(torque(i, t, x[i]), -limit, limit);
    model_.Step(x, u);
    for (size_t i = 0; i < n; ++i) {
      results[i].x.push_back(x[i]);
      results[i].u.push_back(u[i]);
    }
  }
  for (Trajectory& result : results) result = Priced(cost, std::move(result));
  return results;
}

Trajectory TrajectoryOptimizer::Priced(const QuadraticCost& cost, Trajectory trajectory) {
  trajectory.cost = cost.Final(trajectory.x.back());
  for (size_t t = 0; t < trajectory.u.size(); ++t) {
    trajectory.cost += cost.Running(trajectory.x[t], trajectory.u[t]);
  }
  return trajectory;
}

void TrajectoryOptimizer::Improve(const QuadraticCost& cost, double tolerance, int iterations,
                                  Trajectory& trajectory) {
  models_.resize(trajectory.u.size());
  double regularization = kFirst;
  bool moved = true;
  for (int i = 0; i < iterations && regularization < kLargest; ++i) {
    if (moved) {
      model_.Linearize({trajectory.x.data(), trajectory.u.size()}, trajectory.u, models_);
    }
    const double before = trajectory.cost;
    moved = Backward(cost, trajectory, regularization) && Forward(cost, trajectory);
    regularization = moved ? std::max(kLeast, regularization / kFactor) : regularization * kFactor;
    if (moved && before - trajectory.cost < tolerance * std::abs(before)) break;
  }
}

bool TrajectoryOptimizer::Backward(const QuadraticCost& cost, const Trajectory& trajectory,
                                   double regularization) {
  const size_t steps = trajectory.u.size();
  const double limit = model_.plant().torque_limit;
  const Scale& scale = model_.scale();
  const double time2 = scale.time * scale.time, torque2 = scale.torque * scale.torque;
  const StateVector W(1, 1, time2, time2);
  k_.assign(steps, 0);
  K_.assign(steps, Eigen::RowVector4d::Zero());
  CostExpansion last = cost.ExpandFinal(trajectory.x[steps]);
  StateVector Vx = last.x;
  Eigen::Matrix4d Vxx = last.xx;
  for (size_t t = steps; t-- > 0;) {
    const auto& [A, B] = models_[t];
    const double u = trajectory.u[t];
    const CostExpansion l = cost.ExpandRunning(trajectory.x[t], u);
    const StateVector Qx = l.x + A.transpose() * Vx;
    const double Qu = l.u + B.dot(Vx);
    const Eigen::Matrix4d VA = Vxx * A;
    const Eigen::Matrix4d Qxx = l.xx + A.transpose() * VA;
    const Eigen::RowVector4d Qux = B.transpose() * VA;
    const double Quu = l.uu + B.dot(Vxx * B);
    // Regularisation acts like an extra cost on changing the torque and the state that follows.
    // Both count in natural units.
    const StateVector WB = W.cwiseProduct(B);
    const double curvature = Quu + regularization * (1 / torque2 + B.dot(WB));
    const Eigen::RowVector4d change = Qux + regularization * WB.transpose() * A;
    if (!(curvature > 0)) return false;

    const double low = -limit - u, high = limit - u, best = -Qu / curvature;
    k_[t] = std::clamp(best, low, high);
    if (best > low && best < high) K_[t] = -change / curvature;
    Vx = Qx + K_[t].transpose() * (Quu * k_[t] + Qu) + Qux.transpose() * k_[t];
    const Eigen::Matrix4d KQ = K_[t].transpose() * Qux;
    Vxx = Qxx + Quu * K_[t].transpose() * K_[t] + KQ + KQ.transpose();
  }
  return true;
}

bool TrajectoryOptimizer::Forward(const QuadraticCost& cost, Trajectory& trajectory) {
  const size_t steps = trajectory.u.size();
  trial_x_.resize((steps + 1) * kTrials);
  trial_u_.resize(steps * kTrials);
  for (int round = 0; round < kRounds; ++round) {
    std::array<double, kTrials> share{};  // from 1 to 5e-10
    for (int i = 0; i < kTrials; ++i) {
      const int trial = round * kTrials + i;
      share[static_cast<size_t>(i)] = std::pow(1.1, -trial * trial);
    }
    const std::array<double, kTrials> costs = Try(cost, trajectory, share);
    const auto best = std::ranges::min_element(costs);
    if (!(*best < trajectory.cost)) continue;
    const auto trial = static_cast<size_t>(best - costs.begin());
    for (size_t t = 0; t <= steps; ++t) trajectory.x[t] = trial_x_[t * kTrials + trial];
    for (size_t t = 0; t < steps; ++t) trajectory.u[t] = trial_u_[t * kTrials + trial];
    trajectory.cost = *best;
    return true;
  }
  return false;
}

std::array<double, TrajectoryOptimizer::kTrials> TrajectoryOptimizer::Try(
    const QuadraticCost& cost, const Trajectory& trajectory,
    const std::array<double, kTrials>& share) {
  const size_t steps = trajectory.u.size();
  const double limit = model_.plant().torque_limit;
  std::array<double, kTrials> costs{};
  std::fill_n(trial_x_.begin(), kTrials, trajectory.x[0]);
  for (size_t t = 0; t < steps; ++t) {
    StateVector* const x = trial_x_.data() + t * kTrials;
    double* const u = trial_u_.data() + t * kTrials;
    for (size_t trial = 0; trial < kTrials; ++trial) {
      const double change = share[trial] * k_[t] + K_[t].dot(x[trial] - trajectory.x[t]);
      u[trial] = std::clamp(trajectory.u[t] + change, -limit, limit);
      costs[trial] += cost.Running(x[trial], u[trial]);
    }
    std::copy_n(x, kTrials, x + kTrials);
    model_.Step({x + kTrials, kTrials}, {u, kTrials});
  }
  for (size_t trial = 0; trial < kTrials; ++trial) {
    costs[trial] += cost.Final(trial_x_[steps * kTrials + trial]);
    if (!std::isfinite(costs[trial])) costs[trial] = std::numeric_limits<double>::infinity();
  }
  return costs;
}

}  // namespace upswing
