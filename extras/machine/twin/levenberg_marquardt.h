#pragma once

#include "extras/machine/twin/fit_prior.h"
#include "extras/machine/twin/normal_equations.h"
#include "extras/machine/twin/shooting.h"

/// The solver of an identification: Levenberg and Marquardt's method (Marquardt, "An algorithm for
/// least-squares estimation of nonlinear parameters", 1963) with values within their ranges.
namespace upswing::machine {

class LevenbergMarquardt {
 public:
  /// Begins at the model's first point. `model` and `prior` must outlive the solver; the prior may
  /// change between steps.
  LevenbergMarquardt(const ShootingModel& model, const FitPrior& prior);

  const FitPoint& point() const { return point_; }
  /// The scales of the last step.
  const RobustScales& scales() const { return scales_; }

  /// Sets the scales, and makes a step that decreases the cost. Returns whether it decreased by
  /// more than `tolerance` as a share of it.
  bool Step(double tolerance);
  /// Forgets the damping, for a cost that has changed.
  void Restart() { damping_ = kFirstDamping; }
  /// Puts the machine's values at the means of its sessions (FitParameters::Centred).
  void Centre() { point_.theta = model_.parameters().Centred(point_.theta, model_.SeenSessions()); }

 private:
  static constexpr double kFirstDamping = 1e-3;

  double CostOf(const std::vector<WindowResiduals>& residuals, const FitPoint& point) const;
  /// The point that the linearised model takes for the minimum, with the damping.
  FitPoint Candidate(const Linearization& linearization) const;
  /// θ of the candidate.
  Eigen::VectorXd CandidateTheta(const Linearization& linearization) const;

  const ShootingModel& model_;
  const FitPrior& prior_;
  FitPoint point_;
  RobustScales scales_;
  double damping_ = kFirstDamping;  // relative, of the diagonals
};

}  // namespace upswing::machine
