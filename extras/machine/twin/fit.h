#pragma once

#include <span>

#include "base/progress.h"
#include "base/thread_pool.h"
#include "extras/machine/logs/log.h"
#include "extras/machine/logs/windows.h"
#include "extras/machine/twin/fit_parameters.h"
#include "extras/machine/twin/twin.h"

/// Identification of a twin by multiple shooting (Bock, "Recent advances in parameter
/// identification techniques for O.D.E.", 1983): many windows of the logs, each with a free start
/// state, and values that all windows share. Its parts are the values (fit_parameters.h), the model
/// (shooting.h), the prior (fit_prior.h), the solver (levenberg_marquardt.h) and the covariance
/// (fit_covariance.h).
namespace upswing::machine {

/// Settings of an identification.
struct FitConfig {
  WindowRules windows = {1, 0.5};  // seconds, hop
  int iterations = 40;
  double tolerance = 1e-5;  // least relative decrease of the cost in an iteration
  // true: all logs are one new session of the known machine `first`, whose covariance is the prior;
  // values without a covariance have a wide one. The result's covariance is of this session.
  // false: identifies the machine.
  bool adapts = false;
};

/// The result of an identification.
struct FitResult {
  Twin twin;  // with its sessions; the covariance includes the variance between them
  int windows = 0;
  double error = 0;  // median over the windows of the rms of both angles' error, rad
};

/// Identifies the values of a structure. `first` is the initial guess, and has all other values.
/// Throws BadInput if no window of the logs keeps the rules, if a name is unknown, or if the
/// predictions stay hopelessly wrong.
FitResult Fit(std::span<const MachineLog> logs, const Twin& first, const Structure& structure,
              const FitConfig& config, ThreadPool* pool, const Progress& progress = nullptr);

}  // namespace upswing::machine
