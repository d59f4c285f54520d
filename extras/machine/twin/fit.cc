#include "extras/machine/twin/fit.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/twin/fit_covariance.h"
#include "extras/machine/twin/fit_prior.h"
#include "extras/machine/twin/levenberg_marquardt.h"
#include "extras/machine/twin/shooting.h"

namespace upswing::machine {
namespace {

// With values that differ between sessions, θ and the covariance between sessions are estimated in
// turn.
constexpr int kRounds = 3;

/// The values of a structure. An adaptation has a single session, so nothing differs between them.
FitParameters ParametersOf(std::span<const MachineLog> logs, const Twin& first,
                           const Structure& structure, bool adapts) {
  if (adapts) return {first, {structure.name, structure.values}, OneSession(logs)};
  return {first, structure, SessionsOf(logs)};
}

void ExpectWindows(const ShootingModel& model, std::span<const MachineLog> logs, double seconds) {
  if (model.windows() > 0) return;
  throw BadInput(Concat(
      "expected logs with a motion of ", seconds, " s away from upright, got none in ",
      Counted(static_cast<int64_t>(logs.size()), "log"), "; machine check finds units and rests"));
}

/// Steps until the cost no longer decreases. `round` is for the progress.
void Minimise(LevenbergMarquardt& solver, const FitConfig& config, int round,
              const Progress& progress) {
  for (int i = 0; i < config.iterations; ++i) {
    if (!solver.Step(config.tolerance)) return;
    if (progress) progress(round + (i + 1.0) / config.iterations, kRounds);
  }
}

Linearization LinearizationAt(const ShootingModel& model, const LevenbergMarquardt& solver) {
  return LinearizationOf(model, model.Linearize(solver.point()), solver.point(), solver.scales());
}

FitResult ResultOf(const ShootingModel& model, const FitPrior& prior,
                   const LevenbergMarquardt& solver, bool adapts) {
  const FitParameters& parameters = model.parameters();
  const Eigen::VectorXd& theta = solver.point().theta;
  const std::vector<WindowResiduals> residuals = model.Linearize(solver.point());
  const Linearization linearization =
      LinearizationOf(model, residuals, solver.point(), solver.scales());
  FitResult result;
  result.twin = parameters.TwinAt(theta, std::nullopt);
  SetCovariance(parameters,
                adapts ? ModelCovariance(model, linearization, theta, prior)
                       : RobustCovariance(model, linearization, theta, prior),
                prior.between_sessions(), result.twin);
  if (!adapts) {
    for (const int s : model.SeenSessions()) {
      result.twin.sessions.push_back(parameters.SessionAt(theta, s));
    }
  }
  result.windows = model.windows();
  result.error = MedianAngleError(residuals);
  return result;
}

/// Throws BadInput unless the predictions follow the logs.
void ExpectMeaning(const FitResult& result) {
  constexpr double kHopeless = 10;  // median error in a window, rad
  const bool is_finite =
      std::ranges::all_of(result.twin.covariance, [](double x) { return std::isfinite(x); });
  if (result.error < kHopeless && is_finite) return;
  throw BadInput(Concat("expected logs that a model can follow, got a median error of ",
                        result.error, " rad; machine check finds faults of logs"));
}

}  // namespace

FitResult Fit(std::span<const MachineLog> logs, const Twin& first, const Structure& structure,
              const FitConfig& config, ThreadPool* pool, const Progress& progress) {
  const FitParameters parameters = ParametersOf(logs, first, structure, config.adapts);
  const ShootingModel model(logs, parameters, config.windows, pool);
  ExpectWindows(model, logs, config.windows.seconds);
  const double cycle = UsualCycle(logs);
  FitPrior prior = config.adapts ? FitPrior::OfNewSession(parameters, first, cycle)
                                 : FitPrior::OfMachine(parameters, cycle);
  LevenbergMarquardt solver(model, prior);
  Minimise(solver, config, 0, progress);
  solver.Centre();
  for (int round = 1; round < kRounds && parameters.HasDeviations(); ++round) {
    EstimateBetweenSessions(model, LinearizationAt(model, solver), solver.point().theta, prior);
    solver.Restart();
    Minimise(solver, config, round, progress);
  }
  solver.Centre();
  if (progress) progress(kRounds, kRounds);
  const FitResult result = ResultOf(model, prior, solver, config.adapts);
  ExpectMeaning(result);
  return result;
}

}  // namespace upswing::machine
