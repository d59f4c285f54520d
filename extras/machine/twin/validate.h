#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/thread_pool.h"
#include "extras/machine/logs/windows.h"
#include "extras/machine/twin/motion.h"
#include "report/statistics.h"

/// How well models predict measured motion. The error of a window is the rms over its rows of the
/// length of the vector of both angles' errors (rad).
namespace upswing::machine {

/// A model's name, and its twin for each of the logs.
struct Predictor {
  std::string name;
  std::vector<Twin> twins;  // (number of logs)
};

/// A predictor with the same twin for all logs, in each log's session if the twin knows it.
Predictor PredictorOf(const std::string& name, const Twin& twin, std::span<const MachineLog> logs);

/// Whether a log has the reported or commanded torques of all its motors.
bool HasDrive(const MachineLog& log, bool reported);

/// Whether a log has windows of `seconds` in which a twin, driven by commanded or reported torques,
/// can predict its motion.
bool HasWindows(const MachineLog& log, const Twin& twin, double seconds);

/// The errors of the windows of a log. `reported`: driven by the torques that the motors reported
/// instead of the commanded ones.
std::vector<double> WindowErrors(const MachineLog& log, const Twin& twin, double seconds,
                                 bool reported);

/// A row of a comparison: median errors over the windows of some runs, with 95% intervals over
/// bootstrapped runs.
struct ErrorRow {
  std::string session;    // of the runs; empty: all runs
  double seconds = 0;     // length of the windows
  bool reported = false;  // driven by reported torques
  int runs = 0, windows = 0;
  std::vector<Estimate> errors;  // (number of predictors) rad
  // 1 - error of the first predictor / error of the last one.
  Estimate improvement;
};

/// Compares predictors on logs: for each length of windows, a row for each session and one for all
/// runs, with commanded and with reported torques.
std::vector<ErrorRow> CompareErrors(std::span<const MachineLog> logs,
                                    std::span<const Predictor> predictors,
                                    std::span<const double> seconds, ThreadPool* pool);

/// A CSV table of measured angles and of the predictors' angles under the commanded torques (rad),
/// every 10 ms. It has a window of 1 s of each log: the window with that log's median error of the
/// first predictor.
std::string MotionCsv(std::span<const MachineLog> logs, std::span<const Predictor> predictors);

/// Draws two panels as .svg or .png: the errors over the length of the windows, and the measured
/// and predicted angles of a window. The window is of the first log with a window of 1 s, and has
/// that log's median error of the first predictor.
void DrawErrors(std::span<const MachineLog> logs, std::span<const Predictor> predictors,
                const std::filesystem::path& file, ThreadPool* pool);

}  // namespace upswing::machine
