#include "extras/machine/twin/levenberg_marquardt.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace upswing::machine {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLargestDamping = 1e6, kSmallestDamping = 1e-7;
constexpr double kMoreDamping = 8, kLessDamping = 5;  // factors after a step that failed, succeeded
constexpr double kLeastDiagonal = 1e-12;              // for values that the logs do not show

/// Whether a step against the gradient would take a value out of its range.
bool LeavesRange(double value, double gradient, const Range& range) {
  return gradient > 0 ? value <= range.low : value >= range.high;
}

}  // namespace

LevenbergMarquardt::LevenbergMarquardt(const ShootingModel& model, const FitPrior& prior)
    : model_(model), prior_(prior), point_(model.FirstPoint()) {}

double LevenbergMarquardt::CostOf(const std::vector<WindowResiduals>& residuals,
                                  const FitPoint& point) const {
  return prior_.Cost(point.theta) + model_.Cost(residuals, point, scales_);
}

VectorXd LevenbergMarquardt::CandidateTheta(const Linearization& linearization) const {
  const FitParameters& parameters = model_.parameters();
  const NormalEquations equations = EliminateStarts(model_, linearization, damping_);
  MatrixXd A = equations.H + prior_.inverse();
  VectorXd b = equations.g + prior_.Gradient(point_.theta);
  A.diagonal() *= 1 + damping_;
  A.diagonal().array() += kLeastDiagonal;
  // A value that would leave its range stays at the limit.
  for (int i = 0; i < parameters.size(); ++i) {
    if (LeavesRange(point_.theta(i), b(i), parameters[i].range)) FixAtZero(i, A, b);
  }
  VectorXd theta = point_.theta - A.ldlt().solve(b);
  for (int i = 0; i < parameters.size(); ++i) {
    theta(i) = std::clamp(theta(i), parameters[i].range.low, parameters[i].range.high);
  }
  return theta;
}

FitPoint LevenbergMarquardt::Candidate(const Linearization& linearization) const {
  FitPoint candidate{CandidateTheta(linearization), point_.starts};
  const VectorXd change = candidate.theta - point_.theta;
  for (int w = 0; w < model_.windows(); ++w) {
    candidate.starts[w] += ChangeOfStart(
        linearization.blocks[w], linearization.slopes[model_.SessionOfWindow(w)], change, damping_);
  }
  return candidate;
}

bool LevenbergMarquardt::Step(double tolerance) {
  const std::vector<WindowResiduals> residuals = model_.Linearize(point_);
  scales_ = model_.ScalesOf(residuals);
  const Linearization linearization = LinearizationOf(model_, residuals, point_, scales_);
  const double before = CostOf(residuals, point_);
  for (; damping_ < kLargestDamping; damping_ *= kMoreDamping) {
    const FitPoint candidate = Candidate(linearization);
    const double after = CostOf(model_.Residuals(candidate), candidate);
    if (!(after < before)) continue;
    point_ = candidate;
    damping_ = std::max(damping_ / kLessDamping, kSmallestDamping);
    return before - after > tolerance * std::abs(before);
  }
  return false;
}

}  // namespace upswing::machine
