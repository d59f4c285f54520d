#pragma once

#include <Eigen/Core>

#include "extras/machine/twin/fit_prior.h"
#include "extras/machine/twin/normal_equations.h"
#include "extras/machine/twin/shooting.h"

/// How certain an identification is, of one session and between sessions.
namespace upswing::machine {

/// Estimates the prior's covariance between sessions by expectation maximisation (Laird and Ware,
/// "Random-effects models for longitudinal data", 1982), at the linearisation of θ. The prior's
/// first covariance counts as one more session.
void EstimateBetweenSessions(const ShootingModel& model, const Linearization& linearization,
                             const Eigen::VectorXd& theta, FitPrior& prior);

/// The covariance (n × n) of θ under the prior, if the model is true: the inverse of the matrix of
/// the normal equations.
Eigen::MatrixXd ModelCovariance(const ShootingModel& model, const Linearization& linearization,
                                const Eigen::VectorXd& theta, const FitPrior& prior);

/// The covariance (n × n) of θ from the scatter of scores, also if the model is wrong in part:
/// MacKinnon and White, "Some heteroskedasticity-consistent covariance matrix estimators with
/// improved finite sample properties" (1985), HC1.
Eigen::MatrixXd RobustCovariance(const ShootingModel& model, const Linearization& linearization,
                                 const Eigen::VectorXd& theta, const FitPrior& prior);

/// Sets the names and the covariance of the machine's values: the covariance of θ, and that
/// between sessions.
void SetCovariance(const FitParameters& parameters, const Eigen::MatrixXd& covariance,
                   const Eigen::MatrixXd& between_sessions, Twin& twin);

}  // namespace upswing::machine
