#pragma once

#include <Eigen/Core>

#include "extras/machine/twin/fit_parameters.h"

/// What an identification assumes of θ before it sees the logs.
namespace upswing::machine {

/// A normal distribution of θ about the first guess, as (θ - guess)' P (θ - guess) in the cost.
class FitPrior {
 public:
  /// The prior of an identification: the motors' times are of milliseconds or of some cycles of the
  /// logs (`cycle`, s), and sessions deviate little from the machine. Other values have none.
  /// `parameters` must outlive the prior.
  static FitPrior OfMachine(const FitParameters& parameters, double cycle);
  /// The prior of an adaptation: today's machine is one more session of the twin's. Values without
  /// a covariance have a wide one.
  static FitPrior OfNewSession(const FitParameters& parameters, const Twin& twin, double cycle);

  /// P (n × n), the inverse covariance; rows of values without a prior are 0.
  const Eigen::MatrixXd& inverse() const { return inverse_; }
  /// The term of the cost.
  double Cost(const Eigen::VectorXd& theta) const;
  /// Half of its derivative (n).
  Eigen::VectorXd Gradient(const Eigen::VectorXd& theta) const;

  /// The covariance (k × k) of a session's k deviations from the machine, the same for all
  /// sessions.
  const Eigen::MatrixXd& between_sessions() const { return between_sessions_; }
  void SetBetweenSessions(const Eigen::MatrixXd& covariance);
  /// The one that OfMachine assumes.
  const Eigen::MatrixXd& first_between_sessions() const { return first_between_sessions_; }

 private:
  explicit FitPrior(const FitParameters& parameters);

  const FitParameters* parameters_;
  Eigen::MatrixXd inverse_, between_sessions_, first_between_sessions_;
};

}  // namespace upswing::machine
