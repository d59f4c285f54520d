#include "extras/machine/twin/fit_covariance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

namespace upswing::machine {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The solution of the normal equations with the prior.
struct Solution {
  VectorXd change;      // (n) of θ
  MatrixXd covariance;  // (n × n) the inverse of the matrix
};

/// Takes a value at the limit of its range as known.
Solution Solve(const NormalEquations& equations, const FitParameters& parameters,
               const VectorXd& theta, const FitPrior& prior) {
  constexpr double kLeastDiagonal = 1e-12;  // for values that the logs do not show
  const int n = parameters.size();
  MatrixXd A = equations.H + prior.inverse();
  VectorXd b = equations.g + prior.Gradient(theta);
  A.diagonal().array() += kLeastDiagonal;
  MatrixXd I = MatrixXd::Identity(n, n);
  for (int i = 0; i < n; ++i) {
    const Range& range = parameters[i].range;
    if (theta(i) > range.low && theta(i) < range.high) continue;
    FixAtZero(i, A, b);
    I(i, i) = 0;
  }
  const Eigen::LDLT<MatrixXd> factors(A);
  return {-factors.solve(b), factors.solve(I)};
}

MatrixXd Symmetric(const MatrixXd& A) { return (A + A.transpose()) / 2; }

}  // namespace

void EstimateBetweenSessions(const ShootingModel& model, const Linearization& linearization,
                             const VectorXd& theta, FitPrior& prior) {
  constexpr int kIterations = 200;
  const FitParameters& parameters = model.parameters();
  const std::vector<int> seen = model.SeenSessions();
  const NormalEquations equations = EliminateStarts(model, linearization, /*damping=*/0);
  for (int i = 0; i < kIterations; ++i) {
    const Solution solution = Solve(equations, parameters, theta, prior);
    MatrixXd sum = prior.first_between_sessions();
    for (const int s : seen) {
      const std::vector<int> own = parameters.IndicesOfSession(s);
      const VectorXd deviation = (theta + solution.change)(own);
      sum += deviation * deviation.transpose() + solution.covariance(own, own);
    }
    prior.SetBetweenSessions(sum / (std::ssize(seen) + 1.0));
  }
}

MatrixXd ModelCovariance(const ShootingModel& model, const Linearization& linearization,
                         const VectorXd& theta, const FitPrior& prior) {
  const NormalEquations equations = EliminateStarts(model, linearization, /*damping=*/0);
  return Symmetric(Solve(equations, model.parameters(), theta, prior).covariance);
}

MatrixXd RobustCovariance(const ShootingModel& model, const Linearization& linearization,
                          const VectorXd& theta, const FitPrior& prior) {
  const NormalEquations equations = EliminateStarts(model, linearization, /*damping=*/0);
  const MatrixXd inverse = Solve(equations, model.parameters(), theta, prior).covariance;
  MatrixXd scatter = MatrixXd::Zero(theta.size(), theta.size());
  for (const VectorXd& score : equations.scores) scatter += score * score.transpose();
  // The fit makes the scores smaller than those of the true values. HC1 corrects it with the
  // degrees of freedom: scores are the observations, and what the prior determines does not count.
  const double observations = static_cast<double>(equations.scores.size());
  const double freedom = observations - (inverse * equations.H).trace();
  const double factor = observations / std::max(observations / 2, freedom);
  return Symmetric(inverse * (factor * scatter + prior.inverse()) * inverse);
}

void SetCovariance(const FitParameters& parameters, const MatrixXd& covariance,
                   const MatrixXd& between_sessions, Twin& twin) {
  const std::vector<int> own = parameters.IndicesOfMachine();
  MatrixXd total = covariance(own, own);
  std::vector<int> differing;  // places in `own` of the values with deviations of sessions
  for (int k = 0; k < static_cast<int>(own.size()); ++k) {
    if (parameters[own[k]].differs) differing.push_back(k);
    twin.uncertain.push_back(parameters[own[k]].name);
  }
  total(differing, differing) += between_sessions;
  twin.covariance.assign(total.data(), total.data() + total.size());
}

}  // namespace upswing::machine
