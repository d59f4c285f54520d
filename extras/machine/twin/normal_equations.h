#pragma once

#include <Eigen/Core>
#include <vector>

#include "extras/machine/twin/fit_prior.h"
#include "extras/machine/twin/shooting.h"

/// The Gauss-Newton equations of θ, from which the start states of windows are eliminated.
namespace upswing::machine {

/// The model, linearised at a point.
struct Linearization {
  std::vector<WindowBlock> blocks;      // (windows)
  std::vector<Eigen::MatrixXd> slopes;  // (sessions) ∂c/∂θ, constants × n
};
/// `linearized`: residuals and derivatives at the point.
Linearization LinearizationOf(const ShootingModel& model,
                              const std::vector<WindowResiduals>& linearized, const FitPoint& point,
                              const RobustScales& scales);

/// The equations H Δθ = -g of all windows, without the prior.
struct NormalEquations {
  Eigen::MatrixXd H;                    // (n × n)
  Eigen::VectorXd g;                    // (n) sum of the scores
  std::vector<Eigen::VectorXd> scores;  // parts of g that count as independent
};
/// Eliminates the start states. `damping` raises the diagonal of their blocks, as a share of it.
NormalEquations EliminateStarts(const ShootingModel& model, const Linearization& linearization,
                                double damping);

/// The change of a window's start state that goes with a change of θ.
Eigen::Vector4d ChangeOfStart(const WindowBlock& block, const Eigen::MatrixXd& slope,
                              const Eigen::VectorXd& change, double damping);

/// Makes the system A x = b ask for x(i) = 0.
void FixAtZero(int i, Eigen::MatrixXd& A, Eigen::VectorXd& b);

}  // namespace upswing::machine
