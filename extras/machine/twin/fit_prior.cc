#include "extras/machine/twin/fit_prior.h"

#include <Eigen/LU>
#include <cmath>
#include <map>
#include <string>
#include <string_view>

namespace upswing::machine {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Variance of a new session, as a multiple of the twin's: real machines change more from session to
// session than the few that a twin knows.
constexpr double kNewSession = 10;
constexpr double kCogging =
    0.04;  // deviation of a coefficient, N·m in units of FitParameters::scale

/// Typical differences of a value: standard deviations of its prior.
struct Deviations {
  double sessions;  // of a session's value about the machine's; 0: a tenth of the guess
  double guess;     // of the machine's value about a guess without covariance; 0: half of the guess
};

bool IsCogging(const std::string& name) {
  return name.starts_with("sine") || name.starts_with("cosine");
}

bool IsTimeOfMotor(const std::string& name) {
  return name == "delay" || name == "lag" || name == "current_delay";
}

/// Encoders' zeros in rad, dry friction in N·m, times in s. Friction and inertia are in units of
/// `scale`. Times are those of motors and buses of any size, or of slow loops: a log may put a
/// torque a cycle or two from its moment.
Deviations DeviationsOf(const std::string& name, const Scale& scale, double cycle) {
  constexpr double kUsualCycle = 0.002;  // s, for which the times below are

  static const std::map<std::string, Deviations, std::less<>> kDeviations{
      {"zero1", {0.05, 0.05}},          {"zero2", {0.05, 0.05}},
      {"coulomb1", {0.03, 0.1}},        {"coulomb2", {0.03, 0.1}},
      {"damping1", {0.003, 0.02}},      {"damping2", {0.003, 0.02}},
      {"torque_offset1", {0.1, 0.1}},   {"torque_offset2", {0.1, 0.1}},
      {"armature", {0.001, 0.005}},     {"current_inertia", {0.0005, 0.005}},
      {"delay", {0.001, 0.005}},        {"lag", {0.001, 0.005}},
      {"current_delay", {0.001, 0.005}}};
  if (IsCogging(name)) return {kCogging * scale.torque, kCogging * scale.torque};
  const auto found = kDeviations.find(name);
  if (found == kDeviations.end()) return {0, 0};
  double unit = 1;
  if (IsTimeOfMotor(name)) unit = std::max(1.0, cycle / kUsualCycle);
  if (name.starts_with("coulomb") || IsTorqueOffset(name)) unit = scale.torque;
  if (name.starts_with("damping")) unit = scale.torque * scale.time;
  if (name == "armature" || name == "current_inertia") {
    unit = scale.torque * scale.time * scale.time;
  }
  return {found->second.sessions * unit, found->second.guess * unit};
}

/// The covariance (k × k) of a session's k deviations that an identification assumes at first.
MatrixXd FirstBetweenSessions(const FitParameters& parameters, double cycle) {
  const std::vector<int> own = parameters.IndicesOfSession(0);
  VectorXd deviations(std::ssize(own));
  for (int k = 0; k < static_cast<int>(own.size()); ++k) {
    const FitValue& value = parameters[own[k]];
    const double known = DeviationsOf(value.name, parameters.scale(), cycle).sessions;
    deviations(k) = known > 0 ? known : std::abs(parameters.FirstNumber(value.name)) / 10;
  }
  return deviations.cwiseAbs2().asDiagonal();
}

/// The covariance (n × n) of θ in a new session: a multiple of the twin's covariance, wide for
/// values without one.
MatrixXd CovarianceOfNewSession(const FitParameters& parameters, const Twin& twin, double cycle) {
  const int n = parameters.size();
  const auto of_twin = [&](int i, int j) {
    return kNewSession * CovarianceOf(twin, parameters[i].name, parameters[j].name);
  };
  const auto is_known = [&](int i) { return of_twin(i, i) > 0; };
  MatrixXd covariance = MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      if (is_known(i) && is_known(j)) covariance(i, j) = of_twin(i, j);
    }
    if (!is_known(i)) {
      const double wide = DeviationsOf(parameters[i].name, parameters.scale(), cycle).guess;
      covariance(i, i) = std::pow(wide > 0 ? wide : parameters.guess()(i) / 2, 2);
    }
    covariance(i, i) *= 1 + 1e-4;  // positive in spite of rounding
  }
  return covariance;
}

}  // namespace

FitPrior::FitPrior(const FitParameters& parameters)
    : parameters_(&parameters), inverse_(MatrixXd::Zero(parameters.size(), parameters.size())) {}

FitPrior FitPrior::OfMachine(const FitParameters& parameters, double cycle) {
  FitPrior prior(parameters);
  // Motors take milliseconds. Without reported torques, much larger delays can imitate friction.
  // Harmonics that a log hardly tells apart stay small. So do offsets of torques, which near one
  // pose look like zeros.
  for (const int i : parameters.IndicesOfMachine()) {
    const std::string& name = parameters[i].name;
    if (IsTimeOfMotor(name) || IsCogging(name) || IsTorqueOffset(name))
      prior.inverse_(i, i) = std::pow(DeviationsOf(name, parameters.scale(), cycle).guess, -2);
  }
  prior.first_between_sessions_ = FirstBetweenSessions(parameters, cycle);
  prior.SetBetweenSessions(prior.first_between_sessions_);
  return prior;
}

FitPrior FitPrior::OfNewSession(const FitParameters& parameters, const Twin& twin, double cycle) {
  FitPrior prior(parameters);
  prior.inverse_ = CovarianceOfNewSession(parameters, twin, cycle).inverse();
  return prior;
}

double FitPrior::Cost(const VectorXd& theta) const {
  return (theta - parameters_->guess()).dot(Gradient(theta));
}

VectorXd FitPrior::Gradient(const VectorXd& theta) const {
  return inverse_ * (theta - parameters_->guess());
}

void FitPrior::SetBetweenSessions(const MatrixXd& covariance) {
  between_sessions_ = covariance;
  const MatrixXd inverse = covariance.inverse();
  for (int s = 0; s < parameters_->sessions().size(); ++s) {
    const std::vector<int> own = parameters_->IndicesOfSession(s);
    inverse_(own, own) = inverse;
  }
}

}  // namespace upswing::machine
