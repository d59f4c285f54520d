#include "extras/machine/twin/validate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>

#include "base/csv.h"
#include "base/text.h"
#include "report/figure.h"

namespace upswing::machine {
namespace {

/// The errors of all windows of each run (runs × windows).
using RunErrors = std::vector<std::vector<double>>;

/// The median over the windows of the chosen runs, which may repeat.
double MedianOf(const RunErrors& runs, std::span<const double> chosen) {
  std::vector<double> all;
  for (const double run : chosen) {
    std::ranges::copy(runs[static_cast<size_t>(run)], std::back_inserter(all));
  }
  return Median(all);
}

/// A statistic of runs with its interval over runs. Strata are the sessions' runs, by index.
Estimate OverRuns(const Strata& sessions, const std::function<double(std::span<const double>)>& f) {
  const auto statistic = [&](const Strata& strata) {
    std::vector<double> chosen;
    for (const auto& stratum : strata) chosen.insert(chosen.end(), stratum.begin(), stratum.end());
    return f(chosen);
  };
  constexpr int64_t kBootstraps = 2000;
  return {statistic(sessions), BootstrapInterval(sessions, statistic, kBootstraps)};
}

std::vector<double> ErrorsIn(const MachineLog& log, const Twin& twin,
                             std::span<const LogWindow> windows, bool reported) {
  const MotionModel model = reported ? ReportedModel(log, twin) : CommandedModel(log, twin);
  std::vector<double> errors;
  for (const LogWindow& w : windows) {
    const Motion motion = Predict(model, w.start, w.TimesIn(log));
    double sum = 0;
    for (int k = w.first; k < w.last; ++k) {
      for (int j = 0; j < 2; ++j) {
        const double error = motion.angle[k - w.first][j] - log.angle[k][j];
        sum += error * error;
      }
    }
    // A prediction that overflows is infinitely wrong. Medians cannot sort NaN.
    const double error = std::sqrt(sum / (w.last - w.first));
    errors.push_back(std::isfinite(error) ? error : std::numeric_limits<double>::infinity());
  }
  return errors;
}

/// The windows of a log; none if it lacks the torques that drive a prediction.
std::vector<LogWindow> WindowsOf(const MachineLog& log, const Twin& twin, double seconds,
                                 bool reported = false) {
  if (!HasDrive(log, reported)) return {};
  return CutWindows(std::span(&log, 1), {.seconds = seconds}, twin.plant.length1,
                    twin.plant.length2);
}

/// The errors of each predictor in windows of `length` seconds, the same windows for all.
std::vector<RunErrors> ErrorsOf(std::span<const MachineLog> logs,
                                std::span<const Predictor> predictors, double length, bool reported,
                                ThreadPool* pool) {
  std::vector<RunErrors> errors(predictors.size(), RunErrors(logs.size()));
  ParallelFor(pool, static_cast<int>(logs.size()), [&](int i) {
    const auto windows = WindowsOf(logs[i], predictors.front().twins[i], length, reported);
    for (size_t p = 0; p < predictors.size(); ++p) {
      errors[p][i] = ErrorsIn(logs[i], predictors[p].twins[i], windows, reported);
    }
  });
  return errors;
}

/// The runs (indices of logs) of each session, by the session's name.
using RunsOfSessions = std::map<std::string, std::vector<double>>;

RunsOfSessions RunsBySession(std::span<const MachineLog> logs) {
  RunsOfSessions sessions;
  for (size_t i = 0; i < logs.size(); ++i) {
    sessions[SessionOf(logs[i].name)].push_back(static_cast<double>(i));
  }
  return sessions;
}

/// The errors of all predictors over one horizon, driven by one kind of torques.
struct HorizonErrors {
  double seconds;                 // length of the windows
  bool reported;                  // driven by reported torques
  std::vector<RunErrors> errors;  // (number of predictors)

  /// Number of windows of a run. It is the same for all predictors.
  int WindowsOfRun(double run) const {
    return static_cast<int>(errors.front()[static_cast<size_t>(run)].size());
  }
};

/// The row of a session's runs; of all runs if the name is empty.
ErrorRow RowOfRuns(const std::string& session, const Strata& strata, const HorizonErrors& horizon) {
  ErrorRow row{session, horizon.seconds, horizon.reported, 0, 0, {}, {}};
  for (const auto& runs : strata) {
    row.runs += static_cast<int>(runs.size());
    for (const double run : runs) row.windows += horizon.WindowsOfRun(run);
  }
  for (const RunErrors& own : horizon.errors) {
    row.errors.push_back(
        OverRuns(strata, [&](const auto& chosen) { return MedianOf(own, chosen); }));
  }
  const RunErrors &first = horizon.errors.front(), &last = horizon.errors.back();
  row.improvement = OverRuns(strata, [&](const auto& chosen) {
    return 1 - MedianOf(first, chosen) / MedianOf(last, chosen);
  });
  return row;
}

/// A row for each session with windows, then one for all runs if there are two sessions or more.
std::vector<ErrorRow> RowsOfSessions(const RunsOfSessions& sessions, const HorizonErrors& horizon) {
  std::vector<ErrorRow> rows;
  Strata all;
  for (auto [session, runs] : sessions) {
    // Runs without windows have no error.
    std::erase_if(runs, [&](double run) { return horizon.WindowsOfRun(run) == 0; });
    if (runs.empty()) continue;
    rows.push_back(RowOfRuns(session, {runs}, horizon));
    all.push_back(runs);
  }
  if (all.size() > 1) rows.push_back(RowOfRuns("", all, horizon));
  return rows;
}

/// The median errors over the length of the windows.
Panel ErrorsPanel(std::span<const MachineLog> logs, std::span<const Predictor> predictors,
                  ThreadPool* pool) {
  constexpr std::array kLengths{0.1, 0.2, 0.35, 0.5, 0.75, 1.0};  // s
  Panel errors{.x_label = "length of the prediction, s", .y_label = "median error, rad"};
  for (const Predictor& p : predictors) errors.lines.emplace_back().name = p.name;
  for (const double length : kLengths) {
    const std::vector<RunErrors> runs = ErrorsOf(logs, predictors, length, false, pool);
    for (size_t p = 0; p < predictors.size(); ++p) {
      errors.lines[p].x.push_back(length);
      errors.lines[p].y.push_back(PooledMedian(runs[p]));
    }
  }
  return errors;
}

/// The window of a log with the median error of a twin.
const LogWindow& MedianWindow(const MachineLog& log, const Twin& twin,
                              std::span<const LogWindow> windows) {
  const std::vector<double> errors = ErrorsIn(log, twin, windows, false);
  auto sorted = errors;
  std::ranges::sort(sorted);
  const auto place = std::ranges::find(errors, sorted[sorted.size() / 2]) - errors.begin();
  return windows[static_cast<size_t>(place)];
}

/// A twin's prediction of a window, driven by commanded torques.
Motion MotionIn(const MachineLog& log, const Twin& twin, const LogWindow& w) {
  return Predict(CommandedModel(log, twin), w.start, w.TimesIn(log));
}

/// The measured and predicted angles of log `i` in one of its windows.
Panel AnglesPanel(std::span<const MachineLog> logs, std::span<const Predictor> predictors, size_t i,
                  std::span<const LogWindow> windows) {
  const MachineLog& log = logs[i];
  const LogWindow& w = MedianWindow(log, predictors.front().twins[i], windows);
  Panel angles{.title = Printable(log.name), .x_label = "time, s", .y_label = "angle, rad"};
  const auto add = [&](int joint, const std::string& name, const auto& angle_at) -> Line& {
    Line& line = angles.lines.emplace_back(Line{.name = Concat("joint ", joint + 1, ", ", name)});
    for (int k = w.first; k < w.last; ++k) {
      line.x.push_back(log.time[k]);
      line.y.push_back(angle_at(k)[joint]);
    }
    return line;
  };
  for (int j = 0; j < 2; ++j) add(j, "measured", [&](int k) { return log.angle[k]; });
  for (const Predictor& p : predictors) {
    const Motion motion = MotionIn(log, p.twins[i], w);
    for (int j = 0; j < 2; ++j) {
      add(j, p.name, [&](int k) { return motion.angle[k - w.first]; }).dotted_from = -1e9;
    }
  }
  return angles;
}

}  // namespace

Predictor PredictorOf(const std::string& name, const Twin& twin, std::span<const MachineLog> logs) {
  Predictor predictor{name, {}};
  for (const MachineLog& log : logs) predictor.twins.push_back(InSession(twin, log));
  return predictor;
}

bool HasDrive(const MachineLog& log, bool reported) {
  if (reported && log.measured.empty()) return false;
  for (const int joint : {0, 1}) {
    const bool measured = HasTorque(log.measured, joint);
    if (reported && !measured && HasTorque(log.commanded, joint)) return false;
    if (!reported && measured && log.commanded.empty()) return false;
  }
  return true;
}

bool HasWindows(const MachineLog& log, const Twin& twin, double seconds) {
  return !WindowsOf(log, twin, seconds).empty() || !WindowsOf(log, twin, seconds, true).empty();
}

std::vector<double> WindowErrors(const MachineLog& log, const Twin& twin, double seconds,
                                 bool reported) {
  return ErrorsIn(log, twin, WindowsOf(log, twin, seconds, reported), reported);
}

std::vector<ErrorRow> CompareErrors(std::span<const MachineLog> logs,
                                    std::span<const Predictor> predictors,
                                    std::span<const double> seconds, ThreadPool* pool) {
  const RunsOfSessions sessions = RunsBySession(logs);
  std::vector<ErrorRow> rows;
  for (const bool reported : {false, true}) {
    for (const double length : seconds) {
      const HorizonErrors horizon{length, reported,
                                  ErrorsOf(logs, predictors, length, reported, pool)};
      std::ranges::move(RowsOfSessions(sessions, horizon), std::back_inserter(rows));
    }
  }
  return rows;
}

std::string MotionCsv(std::span<const MachineLog> logs, std::span<const Predictor> predictors) {
  constexpr double kRowSeconds = 0.01, kDigits = 1e4;
  CsvTable csv;
  for (size_t i = 0; i < logs.size(); ++i) {
    const MachineLog& log = logs[i];
    const auto windows = WindowsOf(log, predictors.front().twins[i], 1);
    if (windows.empty()) continue;
    const LogWindow& w = MedianWindow(log, predictors.front().twins[i], windows);
    std::vector<Motion> motions;
    for (const Predictor& p : predictors) motions.push_back(MotionIn(log, p.twins[i], w));
    const auto add = [&](const std::string& name, const Joints& angle) {
      for (int j = 0; j < 2; ++j) {
        csv.Add(Concat(name, " ", j + 1), std::round(kDigits * angle[j]) / kDigits);
      }
    };
    for (int k = w.first, rows = 0; k < w.last; ++k) {
      if (log.time[k] - log.time[w.first] < rows * kRowSeconds) continue;
      ++rows;
      csv.Add("log", log.name);
      csv.Add("time", std::round(kDigits * log.time[k]) / kDigits);
      add("measured", log.angle[k]);
      for (size_t p = 0; p < motions.size(); ++p) {
        add(predictors[p].name, motions[p].angle[k - w.first]);
      }
      csv.EndRow();
    }
  }
  return csv.text();
}

void DrawErrors(std::span<const MachineLog> logs, std::span<const Predictor> predictors,
                const std::filesystem::path& file, ThreadPool* pool) {
  Figure figure{.title = "Prediction of measured motion",
                .panels = {ErrorsPanel(logs, predictors, pool)},
                .height = 900};
  for (size_t i = 0; i < logs.size(); ++i) {
    const auto windows = WindowsOf(logs[i], predictors.front().twins[i], 1);
    if (windows.empty()) continue;
    figure.panels.push_back(AnglesPanel(logs, predictors, i, windows));
    break;
  }
  Draw(figure, file);
}

}  // namespace upswing::machine
