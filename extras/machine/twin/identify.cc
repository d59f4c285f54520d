#include "extras/machine/twin/identify.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/logs/check.h"

namespace upswing::machine {
namespace {

constexpr double kJudgedSeconds = 1;  // length of the windows that choose a structure
constexpr double kWorthwhile = 0.95;  // largest error of a better structure, as a share of the best

/// The fold of each log: the logs of a session are dealt in turn. If all sessions have a single
/// log, the sessions are dealt instead. Throws BadInput for a single log.
std::vector<int> Folds(std::span<const MachineLog> logs, int folds) {
  if (logs.size() < 2) {
    throw BadInput(
        "--folds: expected two logs or more for a cross-validation, got 1; "
        "--folds 0 goes without");
  }
  std::map<std::string, int> dealt;
  std::vector<int> fold;
  for (const MachineLog& log : logs) {
    int& logs_before = dealt[SessionOf(log.name)];
    fold.push_back(logs_before % folds);
    ++logs_before;
  }
  if (dealt.size() == logs.size()) {
    for (int i = 0; i < static_cast<int>(logs.size()); ++i) fold[i] = i % folds;
  }
  return fold;
}

/// Geometric mean over sessions of the median error of a session's windows: each session counts the
/// same, however many windows it has. `errors` has those of each log; not a number if all are
/// empty.
double MeanOfSessions(std::span<const MachineLog> logs,
                      std::span<const std::vector<double>> errors) {
  std::map<std::string, std::vector<double>> sessions;
  for (size_t i = 0; i < logs.size(); ++i) {
    if (errors[i].empty()) continue;
    std::vector<double>& session = sessions[SessionOf(logs[i].name)];
    session.insert(session.end(), errors[i].begin(), errors[i].end());
  }
  double sum = 0;
  for (const auto& [name, session] : sessions) sum += std::log(Median(session));
  return std::exp(sum / static_cast<double>(sessions.size()));
}

/// Throws BadInput for a log in which a motor acts without commanded torques, which drive the
/// model.
void ExpectCommands(const MachineLog& log) {
  for (const int joint : {0, 1}) {
    const bool acts = log.commanded.empty() ? HasTorque(log.measured, joint)
                                            : ActsWithoutCommand(std::span(&log, 1), joint);
    if (!acts) continue;
    throw BadInput(Concat(log.name, ": joint ", joint + 1,
                          ": expected commanded torques besides the measured ones, got none; "
                          "--columns can name measured torques as commanded",
                          joint + 1));
  }
}

}  // namespace

std::vector<Structure> Structures(bool has_motors, bool one_body) {
  std::vector<Structure> structures;
  Structure now{"", {"center1", "inertia1", "inertia2"}};
  const auto add = [&](const char* name, const std::vector<std::string>& more) {
    now.name = name;
    now.values.insert(now.values.end(), more.begin(), more.end());
    structures.push_back(now);
  };
  add("rigid links", {has_motors ? "center2" : "length1"});
  add("and viscous friction", {"damping1", "damping2"});
  now.of_session = {"coulomb1", "coulomb2"};
  add("and dry friction of each session", now.of_session);
  if (has_motors) {
    add("and inertia of the motors", {"armature"});
    add("and delay and lag of the motors", {"delay", "lag", "current_delay", "current_inertia"});
  }
  now.of_session.insert(now.of_session.end(), {"zero1", "zero2"});
  add("and zeros of each session", {"zero1", "zero2"});
  if (!has_motors || one_body) return structures;
  now.of_session.insert(now.of_session.end(),
                        {"center1", "center2", "inertia1", "inertia2", "armature"});
  add("and a body of each session", {});
  return structures;
}

Identification Identify(std::span<const MachineLog> logs, const Twin& first,
                        const IdentifyConfig& config, ThreadPool* pool, const Progress& progress) {
  for (const MachineLog& log : logs) ExpectCommands(log);
  const std::vector<Structure> structures = Structures(HasCommands(logs), config.one_body);
  Identification result;
  const int n = static_cast<int>(logs.size());
  const double fits = 1.0 + config.folds * static_cast<double>(structures.size());
  double done = 0;
  const auto fit = [&](std::span<const MachineLog> own, const Twin& guess, const Structure& s,
                       const FitConfig& how) {
    const auto part = [&](double step, double steps) {
      if (progress) progress(done + step / steps, fits);
    };
    FitResult r = Fit(own, guess, s, how, pool, part);
    ++done;
    return r;
  };

  result.chosen = static_cast<int>(structures.size()) - 1;
  // A comparison needs less than a result: windows in a row, and fewer digits.
  FitConfig rough = config.fit;
  rough.windows.hop = rough.windows.seconds;
  rough.tolerance = std::max(1e-4, rough.tolerance);
  if (config.folds >= 2) {
    const std::vector<int> fold = Folds(logs, config.folds);
    double best = 0;
    std::vector<Twin> guesses(config.folds, first);
    for (int s = 0; s < static_cast<int>(structures.size()); ++s) {
      std::vector<Twin> twins(n, first);
      for (int f = 0; f < config.folds; ++f) {
        std::vector<MachineLog> others;
        for (int i = 0; i < n; ++i) {
          if (fold[i] != f) others.push_back(logs[i]);
        }
        // Each structure begins with the values of the one before it.
        guesses[f] = fit(others, guesses[f], structures[s], rough).twin;
        for (int i = 0; i < n; ++i) {
          if (fold[i] == f) twins[i] = InSession(guesses[f], logs[i]);
        }
      }
      std::vector<std::vector<double>> errors(n);
      ParallelFor(pool, n, [&](int i) {
        errors[i] = WindowErrors(logs[i], twins[i], kJudgedSeconds, false);
      });
      const double error = MeanOfSessions(logs, errors);
      result.structures.push_back({structures[s], error});
      if (s > 0 && !(error < kWorthwhile * best)) continue;
      best = error;
      result.chosen = s;
      result.left_out = twins;
    }
  }
  result.fit = fit(logs, first, structures[result.chosen], config.fit);
  MeasureLoop(logs, result.fit.twin);
  return result;
}

void MeasureLoop(std::span<const MachineLog> logs, Twin& twin) {
  std::vector<double> periods, jitters, steps, torque_steps;
  twin.loop.late = 0;
  double cycles = 0, late = 0;
  const auto note_step = [](double step, std::vector<double>& list) {
    if (std::abs(step) > 1e-9) list.push_back(std::abs(step));
  };
  for (const MachineLog& log : logs) {
    std::vector<double> own;
    for (int k = 1; k < log.rows(); ++k) {
      own.push_back(log.time[k] - log.time[k - 1]);
      note_step(log.angle[k][0] - log.angle[k - 1][0], steps);
      if (!log.measured.empty()) {
        note_step(log.measured[k][0] - log.measured[k - 1][0], torque_steps);
      }
    }
    if (own.empty()) continue;
    const double period = Median(own);
    double squares = 0, on_time = 0;
    for (const double p : own) {
      if (p > 5 * period) continue;  // a gap
      if (p > 1.25 * period) {
        ++late;
        twin.loop.late = std::max(twin.loop.late, p - period);
      } else {
        squares += (p - period) * (p - period);
        ++on_time;
      }
    }
    cycles += static_cast<double>(own.size());
    periods.push_back(period);
    jitters.push_back(std::sqrt(squares / on_time));
  }
  if (periods.empty()) return;
  twin.loop.period = Median(periods);
  twin.loop.jitter = Median(jitters);
  twin.loop.late_share = late / cycles;
  if (!steps.empty()) twin.sensors.quantum = std::ranges::min(steps);
  if (!torque_steps.empty()) twin.sensors.torque_quantum = std::ranges::min(torque_steps);
}

}  // namespace upswing::machine
