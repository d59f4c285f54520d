#include "extras/machine/twin/identify.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/twin/length_by_motion.h"
#include "extras/machine/twin/physics_rules.h"
#include "pendulum/posterior.h"

namespace upswing::machine {
namespace {

constexpr double kJudgedSeconds = 1;  // length of the windows that choose a structure, s
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

/// Length (s) of the windows that choose a structure. For machines of another size it counts in
/// their natural time.
double JudgedSeconds(const Twin& twin) { return kJudgedSeconds * ScaleOverUsual(twin.plant).time; }

/// Progress of several fits of equal weight, one after the other.
class FitCounter {
 public:
  FitCounter(double fits, const Progress& progress) : fits_(fits), progress_(progress) {}
  /// The progress of the next fit.
  Progress NextPart() {
    const double done = begun_++;
    return [this, done](double step, double steps) {
      if (progress_) progress_(done + step / steps, fits_);
    };
  }

 private:
  double fits_, begun_ = 0;
  const Progress& progress_;
};

/// The settings of a fit whose result is only compared: it needs windows in a row, and fewer
/// digits.
FitConfig ForComparison(FitConfig config) {
  config.windows.hop = config.windows.seconds;
  config.tolerance = std::max(1e-4, config.tolerance);
  return config;
}

/// Twins of a structure from logs without those of a fold.
struct LeftOut {
  std::vector<Twin> of_folds;  // (folds)
  std::vector<Twin> twins;     // (logs) the twin that has not seen the log
  double error;                // MeanOfSessions over JudgedSeconds, rad
};

constexpr const char* kZerosOfSessions = "and zeros of each session";
const std::vector<std::string> kZeros{"zero1", "zero2"};
const std::vector<std::string> kOffsets{"torque_offset1", "torque_offset2"};

/// Fits structures to the logs without a fold, and predicts those of the fold.
class CrossValidation {
 public:
  CrossValidation(std::span<const MachineLog> logs, const Twin& first, const IdentifyConfig& config,
                  ThreadPool* pool, FitCounter& counter)
      : logs_(logs),
        fold_of_(Folds(logs, config.folds)),
        config_(ForComparison(config.fit)),
        seconds_(JudgedSeconds(first)),
        pool_(pool),
        counter_(counter) {}

  /// Begins with the values of the twins `guesses` (folds), which have another structure.
  LeftOut LeaveOut(const Structure& structure, const std::vector<Twin>& guesses) {
    const int n = static_cast<int>(logs_.size());
    LeftOut result;
    for (int fold = 0; fold < static_cast<int>(guesses.size()); ++fold) {
      result.of_folds.push_back(
          Fit(Without(fold), guesses[fold], structure, config_, pool_, counter_.NextPart()).twin);
    }
    for (int i = 0; i < n; ++i) {
      result.twins.push_back(InSession(result.of_folds[fold_of_[i]], logs_[i]));
    }
    std::vector<std::vector<double>> errors(n);
    ParallelFor(pool_, n, [&](int i) {
      errors[i] = WindowErrors(logs_[i], result.twins[i], seconds_, /*reported=*/false);
    });
    result.error = MeanOfSessions(logs_, errors);
    return result;
  }

 private:
  std::vector<MachineLog> Without(int fold) const {
    std::vector<MachineLog> others;
    for (size_t i = 0; i < logs_.size(); ++i) {
      if (fold_of_[i] != fold) others.push_back(logs_[i]);
    }
    return others;
  }

  std::span<const MachineLog> logs_;
  std::vector<int> fold_of_;  // (logs)
  FitConfig config_;
  double seconds_;  // length of the windows that choose a structure
  ThreadPool* pool_;
  FitCounter& counter_;
};

/// Judges a fit of this structure by the middle third of each log. A second fit does not see these
/// parts. Nothing if one of the parts has too few windows: a fit without a prior needs one for each
/// value.
std::optional<Judgement> JudgeByMiddles(std::span<const MachineLog> logs, const Twin& start,
                                        const Structure& structure, const FitConfig& config,
                                        ThreadPool* pool) {
  std::vector<MachineLog> middles, others;
  for (const MachineLog& log : logs) {
    const int begin = log.rows() / 3, end = 2 * log.rows() / 3;
    if (begin < 2) continue;
    others.push_back(PieceOf(log, 0, begin));
    middles.push_back(PieceOf(log, begin, end));
    others.push_back(PieceOf(log, end, log.rows()));
  }
  try {
    const FitResult fit = Fit(others, start, structure, ForComparison(config), pool);
    const int fewest = config.adapts ? 4 : static_cast<int>(structure.values.size());
    if (fit.windows < fewest) return std::nullopt;
    const Judgement judgement = Judge(middles, PredictorOf("", fit.twin, middles).twins,
                                      "the left-out parts of the logs", pool);
    if (judgement.windows > 0) return judgement;
  } catch (const Error&) {  // no window
  }
  return std::nullopt;
}

Judgement JudgeFit(const Identification& found, std::span<const MachineLog> logs, const Twin& first,
                   const Structure& structure, const FitConfig& config, ThreadPool* pool) {
  if (!found.left_out.empty()) return Judge(logs, found.left_out, "the left-out logs", pool);
  // A prior is that of the first guess. Other fits begin where the fit to all logs ended.
  const Twin& start = config.adapts ? first : found.fit.twin;
  const auto by_parts = JudgeByMiddles(logs, start, structure, config, pool);
  if (by_parts) return *by_parts;
  return Judge(logs, PredictorOf("", found.fit.twin, logs).twins, "the logs of the fit", pool);
}

/// The least change between rows of joint 1, which is a step of the encoder or of the reports;
/// nothing if no row differs.
std::optional<double> LeastChange(std::span<const MachineLog> logs,
                                  std::vector<Joints> MachineLog::*quantity) {
  std::optional<double> least;
  for (const MachineLog& log : logs) {
    const std::vector<Joints>& values = log.*quantity;
    for (size_t k = 1; k < values.size(); ++k) {
      const double change = std::abs(values[k][0] - values[k - 1][0]);
      if (change > 1e-9) least = std::min(change, least.value_or(change));
    }
  }
  return least;
}

/// Timing of the cycles of a log.
struct CycleTiming {
  double period;                // median, s
  double jitter;                // standard deviation of cycles that are not late, s
  double cycles = 0, late = 0;  // numbers
  double latest = 0;            // largest lateness, s
};

/// `cycles`: time between the rows, at least one, s.
CycleTiming TimingOf(const std::vector<double>& cycles) {
  constexpr double kGap = 5, kLate = 1.25;  // longest cycles that are late, on time; of the median
  CycleTiming timing{.period = Median(cycles), .jitter = 0};
  timing.cycles = static_cast<double>(cycles.size());
  double squares = 0, on_time = 0;
  for (const double cycle : cycles) {
    if (cycle > kGap * timing.period) continue;
    const double lateness = cycle - timing.period;
    if (cycle > kLate * timing.period) {
      ++timing.late;
      timing.latest = std::max(timing.latest, lateness);
    } else {
      squares += lateness * lateness;
      ++on_time;
    }
  }
  timing.jitter = std::sqrt(squares / on_time);
  return timing;
}

/// How a twin explains hanging links, by its uncertain values.
HangingBy CauseIn(const Twin& twin) {
  const auto has = [&](const char* name) { return CovarianceOf(twin, name, name) > 0; };
  if (!has("torque_offset1") && !has("torque_offset2")) return HangingBy::kZeros;
  return has("zero1") || has("zero2") ? HangingBy::kBoth : HangingBy::kOffsets;
}

/// Adds a structure to the result, which chooses it if it is worthwhile. Returns whether it does.
bool Judge(const Structure& structure, const LeftOut& left_out, Identification& result) {
  const bool is_first = result.structures.empty();
  const double best = is_first ? 0 : result.structures[result.chosen].error;
  result.structures.push_back({structure, left_out.error});
  if (!is_first && !(left_out.error < kWorthwhile * best)) return false;
  result.chosen = static_cast<int>(result.structures.size()) - 1;
  result.left_out = left_out.twins;
  result.of_fold = left_out.of_folds.front();
  return true;
}

/// Tries the structures one after the other. Offsets of torques compete with the encoders' zeros if
/// there are motors, and the structures after that have the winner.
void ChooseStructure(std::span<const Structure> structures, bool has_motors,
                     std::vector<Twin> guesses, CrossValidation& validation,
                     Identification& result) {
  HangingBy cause = HangingBy::kZeros;
  for (const Structure& with_zeros : structures) {
    const Structure structure = Hanging(with_zeros, cause);
    const std::vector<Twin> before = guesses;
    const LeftOut left_out = validation.LeaveOut(structure, before);
    guesses = left_out.of_folds;
    Judge(structure, left_out, result);
    if (structure.name != kZerosOfSessions || !has_motors) continue;
    for (const HangingBy other : {HangingBy::kOffsets, HangingBy::kBoth}) {
      Structure rival = Hanging(with_zeros, other);
      rival.name = other == HangingBy::kBoth ? "and torque offsets of each session"
                                             : "torque offsets in place of zeros";
      const LeftOut rivals = validation.LeaveOut(rival, before);
      if (!Judge(rival, rivals, result)) continue;
      cause = other;
      guesses = rivals.of_folds;
    }
  }
}

}  // namespace

std::vector<Structure> Structures(bool has_motors, bool cogging, bool one_body) {
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
  // The rotors of idle motors turn with the links.
  add("and inertia of the motors", {"armature"});
  if (has_motors) {
    add("and delay and lag of the motors", {"delay", "lag", "current_delay", "current_inertia"});
  }
  now.of_session.insert(now.of_session.end(), kZeros.begin(), kZeros.end());
  add(kZerosOfSessions, kZeros);
  if (cogging) add("and cogging of the motors", CoggingCoefficients());
  if (!has_motors || one_body) return structures;
  now.of_session.insert(now.of_session.end(),
                        {"center1", "center2", "inertia1", "inertia2", "armature"});
  add("and a body of each session", {});
  return structures;
}

Structure Hanging(Structure structure, HangingBy cause) {
  for (auto* names : {&structure.values, &structure.of_session}) {
    // clang 14 does not compile std::ranges::search.
    const auto zeros = std::search(names->begin(), names->end(), kZeros.begin(), kZeros.end());
    if (cause == HangingBy::kZeros || zeros == names->end()) continue;
    const auto end = zeros + std::ssize(kZeros);
    const auto after = cause == HangingBy::kOffsets ? names->erase(zeros, end) : end;
    names->insert(after, kOffsets.begin(), kOffsets.end());
  }
  return structure;
}

namespace {

/// Identify with the joints' armatures as in `first`.
Identification IdentifyFrom(const Twin& first, std::span<const MachineLog> logs,
                            const IdentifyConfig& config, ThreadPool* pool,
                            const Progress& progress) {
  const std::vector<Structure> structures =
      Structures(HasCommands(logs), first.cogging.any(), config.one_body);
  const int folds = config.folds >= 2 ? config.folds : 0;
  const auto trials = static_cast<double>(structures.size()) + (HasCommands(logs) ? 2 : 0);
  FitCounter counter(1.0 + folds * trials, progress);
  Identification result;
  result.seconds = JudgedSeconds(first);
  result.chosen = static_cast<int>(structures.size()) - 1;
  if (folds > 0) {
    CrossValidation validation(logs, first, config, pool, counter);
    ChooseStructure(structures, HasCommands(logs), std::vector<Twin>(folds, first), validation,
                    result);
  }
  const Structure chosen = folds > 0 ? result.structures[result.chosen].structure
                                     : Hanging(structures.back(), CauseIn(first));
  result.fit = Fit(logs, first, chosen, config.fit, pool, counter.NextPart());
  if (!result.left_out.empty()) {
    // The folds found their values structure by structure. Where all values at once end in a wrong
    // minimum, those of a fold are a better start.
    constexpr double kBetter = 0.9;
    FitResult again = Fit(logs, result.of_fold, chosen, config.fit, pool);
    if (again.error < kBetter * result.fit.error) result.fit = std::move(again);
  }
  MeasureLoop(logs, result.fit.twin);
  result.judgement = JudgeFit(result, logs, first, chosen, config.fit, pool);
  result.fit.twin.distrust =
      DistrustOf(result.judgement, result.fit.twin, logs, first.plant.length1);
  return result;
}

}  // namespace

Identification Identify(std::span<const MachineLog> logs, const Twin& first,
                        const IdentifyConfig& config, ThreadPool* pool, const Progress& progress) {
  for (const MachineLog& log : logs) ExpectCommands(log);
  Identification result = IdentifyFrom(first, logs, config, pool, progress);
  // A motion shows only the sum of inertia1 and the armature of joint 1. If joint 2 has more
  // armature than this sum, the fit presses inertia1 to its lower limit. Then all of the sum is the
  // link's.
  const Plant& found = result.fit.twin.plant;
  const Range range = UncertainRange(*OptionsOf(found).Get("inertia1"));
  const bool is_known = config.fit.adapts || first.plant.armature1 >= 0;
  if (is_known || found.inertia1 > range.low) return result;
  Twin passive = first;
  passive.plant.armature1 = 0;
  Identification other = IdentifyFrom(passive, logs, config, pool, progress);
  return other.fit.error < result.fit.error ? other : result;
}

std::string DistrustOf(const Judgement& judgement, const Twin& twin,
                       std::span<const MachineLog> logs, double length1) {
  const bool reports = std::ranges::any_of(
      logs, [](const MachineLog& log) { return !log.commanded.empty() && !log.measured.empty(); });
  std::vector<std::string> reasons;
  if (!judgement.explains()) reasons.push_back(SentenceOf(judgement));
  for (const std::string& line : OutsidePhysics(twin, reports)) reasons.push_back(line);
  const std::string contradiction = LengthContradiction(logs, twin, length1);
  if (!contradiction.empty()) reasons.push_back(contradiction);
  return Join(reasons, "; ");
}

void MeasureLoop(std::span<const MachineLog> logs, Twin& twin) {
  std::vector<double> periods, jitters;  // of logs
  double cycles = 0, late = 0, latest = 0;
  for (const MachineLog& log : logs) {
    std::vector<double> own;
    for (int k = 1; k < log.rows(); ++k) own.push_back(log.time[k] - log.time[k - 1]);
    if (own.empty()) continue;
    const CycleTiming timing = TimingOf(own);
    periods.push_back(timing.period);
    jitters.push_back(timing.jitter);
    cycles += timing.cycles;
    late += timing.late;
    latest = std::max(latest, timing.latest);
  }
  twin.loop.late = latest;
  if (periods.empty()) return;
  twin.loop.period = Median(periods);
  twin.loop.jitter = Median(jitters);
  twin.loop.late_share = late / cycles;
  MachineSensors& sensors = twin.sensors;
  sensors.quantum = LeastChange(logs, &MachineLog::angle).value_or(sensors.quantum);
  sensors.torque_quantum =
      LeastChange(logs, &MachineLog::measured).value_or(sensors.torque_quantum);
}

}  // namespace upswing::machine
