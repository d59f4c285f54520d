#include "extras/machine/logs/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <set>
#include <system_error>

#include "base/error.h"
#include "base/format.h"
#include "base/json.h"
#include "base/sample.h"
#include "base/text.h"
#include "extras/machine/logs/angle_noise.h"
#include "extras/machine/logs/smooth_motion.h"

namespace upswing::machine {
namespace {

/// A cycle: the time from a row to the next.
struct Cycle {
  const MachineLog* piece;
  int row;  // index of the later row in its piece
  double seconds;
};

std::vector<Cycle> CyclesOf(Pieces pieces) {
  std::vector<Cycle> cycles;
  for (const MachineLog& piece : pieces) {
    for (int k = 1; k < piece.rows(); ++k) {
      cycles.push_back({&piece, k, piece.time[k] - piece.time[k - 1]});
    }
  }
  return cycles;
}

std::vector<double> SortedSeconds(const std::vector<Cycle>& cycles) {
  std::vector<double> seconds;
  for (const Cycle& cycle : cycles) seconds.push_back(cycle.seconds);
  std::ranges::sort(seconds);
  return seconds;
}

double UsualOf(std::span<const double> sorted) {
  const size_t quarter = sorted.size() / 4;
  return MomentsOf(sorted.subspan(quarter, sorted.size() - 2 * quarter)).mean;
}

LogRows RangeOf(const Cycle& cycle) {
  return machine::RangeOf(*cycle.piece, cycle.row - 1, cycle.row);
}

void CheckClockUnit(double usual, const Reporter& report) {
  constexpr double kFast = 2e-5, kVeryFast = 2e-7, kSlow = 0.5, kVerySlow = 50;  // s
  if (usual < kFast) {
    report(Severity::kFault,
           fmt::format("cycles of {:.4g} s: suspect that the key unit or factor makes the clock {} "
                       "times too fast",
                       usual, usual < kVeryFast ? "a million" : "a thousand"));
  }
  if (usual < kSlow) return;
  const char* unit = usual < kVerySlow ? "ms" : "µs";
  std::string text =
      fmt::format("cycles of {:.4g} s: suspect a clock in {} (key unit)", usual, unit);
  if (usual == 1) text += ", or numbers of rows (key factor)";
  report(Severity::kFault, text);
}

/// Whether a clock counts rows instead of measuring them: nearly all cycles are equal.
bool IsNominal(const std::vector<Cycle>& cycles, double usual) {
  constexpr double kEqual = 1e-3, kMost = 0.99;  // of a cycle, share of the cycles
  const auto equal = std::ranges::count_if(
      cycles, [&](const Cycle& cycle) { return std::abs(cycle.seconds - usual) < kEqual * usual; });
  return static_cast<double>(equal) > kMost * static_cast<double>(cycles.size());
}

/// Cycles that are longer count as gaps, s.
double GapOf(double usual) { return std::max(0.05, 20 * usual); }

/// Reports rows with the time of the row before.
void CheckStandingClock(const std::vector<Cycle>& cycles, const Reporter& report) {
  constexpr double kMuch = 0.1;  // share of cycles
  const auto stands = [](const Cycle& cycle) { return cycle.seconds <= 0; };
  const auto standing = static_cast<int>(std::ranges::count_if(cycles, stands));
  if (standing == 0) return;
  Severity severity = Severity::kWarning;
  std::string text = fmt::format("the clock stands still in {}", Counted(standing, "row"));
  if (standing > kMuch * static_cast<double>(cycles.size())) {
    severity = Severity::kFault;
    text += ": suspect rows that are there twice, or times with too few digits";
  } else if (standing > 1) {
    text += ", first";
  }
  report(severity, text, RangeOf(*std::ranges::find_if(cycles, stands)), {{"standing", standing}});
}

void CheckLostCycles(const std::vector<Cycle>& cycles, double usual, const Reporter& report) {
  constexpr double kLate = 1.5;  // usual cycles; a longer cycle lost at least one
  int places = 0;
  double lost = 0;
  const Cycle* longest = nullptr;
  for (const Cycle& cycle : cycles) {
    if (cycle.seconds <= kLate * usual || cycle.seconds > GapOf(usual)) continue;
    if (!longest || cycle.seconds > longest->seconds) longest = &cycle;
    ++places;
    lost += std::round(cycle.seconds / usual) - 1;
  }
  if (longest == nullptr) return;
  constexpr double kMuch = 0.01;  // share of cycles
  const double share = lost / (lost + static_cast<double>(cycles.size()));
  report(share > kMuch ? Severity::kWarning : Severity::kNote,
         fmt::format("{} ({}) lost at {}, longest {} ms",
                     Counted(std::lround(std::min(lost, 1e15)), "cycle"), FormatPercent(share),
                     Counted(places, "place"), FormatPlain(1e3 * longest->seconds, 3)),
         RangeOf(*longest), {{"lost", lost}, {"places", places}});
}

/// Reports gaps. A model of the motion leaves them out, but after a long one little is left.
void CheckGaps(const std::vector<Cycle>& cycles, double usual, double own_time,
               const Reporter& report) {
  constexpr int kMostGaps = 10;                 // with a line each
  constexpr double kLong = 4, kUnknown = 0.25;  // own times of the motion; s, without motion
  const double fault = kLong * (own_time > 0 ? own_time : kUnknown);
  const auto severity = [&](double seconds) {
    return seconds > fault ? Severity::kFault : Severity::kWarning;
  };
  int gaps = 0;
  double longest = 0;  // of the gaps without a line, s
  for (const Cycle& cycle : cycles) {
    if (cycle.seconds <= GapOf(usual)) continue;
    ++gaps;
    if (gaps > kMostGaps) {
      longest = std::max(longest, cycle.seconds);
      continue;
    }
    report(severity(cycle.seconds), fmt::format("a gap of {:.4g} s", cycle.seconds), RangeOf(cycle),
           {{"gap", cycle.seconds}});
  }
  if (gaps > kMostGaps) {
    report(severity(longest),
           fmt::format("{}, the longest {:.4g} s", Counted(gaps - kMostGaps, "more gap"), longest));
  }
}

}  // namespace

const char* NameOf(Severity severity) {
  constexpr const char* kNames[] = {"note", "warning", "fault"};
  return kNames[static_cast<int>(severity)];
}

const char* NameOf(Aspect aspect) {
  constexpr const char* kNames[] = {"clock", "angle", "velocity", "torque", "motion"};
  return kNames[static_cast<int>(aspect)];
}

LogRows RangeOf(const MachineLog& piece, int first, int last) {
  return {piece.first_row + first, piece.first_row + last, piece.time[first], piece.time[last]};
}

double UsualCycle(Pieces pieces) { return UsualOf(SortedSeconds(CyclesOf(pieces))); }

double CentralDifference(const MachineLog& log, int k, int joint) {
  const double seconds = log.time[k + 1] - log.time[k - 1];
  return seconds > 0 ? (log.angle[k + 1][joint] - log.angle[k - 1][joint]) / seconds : 0;
}

std::vector<double> ValuesOf(Pieces pieces, std::vector<Joints> MachineLog::*quantity, int joint) {
  std::vector<double> values;
  for (const MachineLog& piece : pieces) {
    for (const Joints& pair : piece.*quantity) values.push_back(pair[joint]);
  }
  return values;
}

double AngleRange(Pieces pieces, int joint) {
  const auto [low, high] = std::ranges::minmax(ValuesOf(pieces, &MachineLog::angle, joint));
  return high - low;
}

void CheckClock(Pieces pieces, Findings& findings) {
  const Reporter report{findings, Aspect::kClock};
  const std::vector<Cycle> cycles = CyclesOf(pieces);
  const std::vector<double> seconds = SortedSeconds(cycles);
  const double usual = UsualOf(seconds), p99 = Quantile(seconds, 0.99);
  if (usual <= 0) {
    return report(Severity::kFault,
                  "the clock hardly ever advances: suspect times with too few digits");
  }
  report(Severity::kNote,
         fmt::format("{:.4g} Hz, cycles of {:.4g} ms (usual), {:.4g} ms (99%), {:.4g} ms (longest)",
                     1 / usual, 1e3 * usual, 1e3 * p99, 1e3 * seconds.back()),
         {}, {{"usual", usual}, {"p99", p99}, {"longest", seconds.back()}});
  CheckClockUnit(usual, report);
  CheckStandingClock(cycles, report);
  CheckLostCycles(cycles, usual, report);
  if (IsNominal(cycles, usual)) CheckLostRows(pieces, usual, report);
  CheckGaps(cycles, usual, OwnTime(pieces), report);
}

bool LogCheck::faulty() const {
  return std::ranges::any_of(
      findings, [](const Finding& finding) { return finding.severity == Severity::kFault; });
}

bool IsStuck(const Findings& findings, int joint) {
  return std::ranges::any_of(findings, [&](const Finding& finding) {
    return finding.aspect == Aspect::kAngle && finding.joint == joint + 1 &&
           (finding.text.starts_with("the encoder sticks") ||
            finding.text.starts_with("saturates"));
  });
}

/// Whether the equations of motion explain a log as it is, or after a change.
bool IsJudgedByMotion(const Findings& findings) {
  return std::ranges::any_of(findings, [](const Finding& finding) {
    const bool is_motion = !finding.numbers.empty() && finding.numbers[0].first == "unexplained";
    return is_motion && (finding.severity == Severity::kNote || finding.numbers.size() > 1);
  });
}

LogCheck CheckLog(const std::string& name, Pieces pieces) {
  LogCheck check{name, 0, static_cast<int>(pieces.size()), 0, pieces.front().columns, {}};
  for (const MachineLog& piece : pieces) {
    check.rows += piece.rows();
    check.seconds += piece.time.back() - piece.time.front();
  }
  CheckClock(pieces, check.findings);
  CheckAngles(pieces, check.findings);
  CheckJumps(pieces, check.findings);
  CheckVelocities(pieces, check.findings);
  const std::vector<MachineLog> without_rotors = WithoutRotors(pieces);
  CheckTorques(without_rotors, check.findings);
  CheckMotion(without_rotors, check.findings);
  if (!IsJudgedByMotion(check.findings)) CheckSpeeds(pieces, check.findings);
  return check;
}

std::string AboutText(const Finding& finding) {
  const std::string aspect = NameOf(finding.aspect);
  return finding.joint > 0 ? Concat(aspect, " ", finding.joint) : aspect;
}

std::vector<MachineLog> ReadCheckedLogs(std::span<const std::string> files,
                                        const std::string& columns,
                                        const std::function<void(const std::string&)>& warn) {
  std::vector<std::string> sorted(files.begin(), files.end());
  std::ranges::sort(sorted);
  std::set<std::filesystem::path> seen;
  std::vector<MachineLog> logs;
  for (const std::string& file : sorted) {
    std::error_code error;
    if (!seen.insert(std::filesystem::weakly_canonical(file, error)).second) {
      throw BadInput(Concat("expected each log once, got ", Printable(file), " twice"));
    }
    std::vector<MachineLog> pieces = ReadLog(file, columns);
    const LogCheck check = CheckLog(file, pieces);
    const auto fault = std::ranges::find(check.findings, Severity::kFault, &Finding::severity);
    if (fault != check.findings.end()) {
      warn(Concat("warning: ", Printable(file), ": ", AboutText(*fault), ": ", fault->text,
                  "; machine check lists all faults"));
    }
    std::ranges::move(pieces, std::back_inserter(logs));
  }
  return logs;
}

std::string RowsText(const LogRows& rows) {
  return fmt::format("rows {} to {} ({:.3f} to {:.3f} s)", rows.first, rows.last, rows.begin,
                     rows.end);
}

std::string CheckJson(std::span<const LogCheck> checks) {
  nlohmann::ordered_json logs = nlohmann::ordered_json::array();
  for (const LogCheck& check : checks) {
    nlohmann::ordered_json log{{"name", check.name},
                               {"rows", check.rows},
                               {"pieces", check.pieces},
                               {"seconds", check.seconds},
                               {"faulty", check.faulty()},
                               {"columns", nlohmann::ordered_json::object()},
                               {"findings", nlohmann::ordered_json::array()}};
    for (const ReadColumn& column : check.columns) {
      log["columns"][column.key] = {
          {"name", column.name}, {"unit", column.unit}, {"factor", column.factor}};
    }
    for (const Finding& finding : check.findings) {
      nlohmann::ordered_json j{{"aspect", NameOf(finding.aspect)},
                               {"severity", NameOf(finding.severity)},
                               {"text", finding.text}};
      if (finding.joint > 0) j["joint"] = finding.joint;
      if (finding.rows) {
        j["rows"] = {finding.rows->first, finding.rows->last};
        j["time"] = {finding.rows->begin, finding.rows->end};
      }
      for (const auto& [name, number] : finding.numbers) j[name] = number;
      log["findings"].push_back(std::move(j));
    }
    logs.push_back(std::move(log));
  }
  return PrintableJson({{"logs", logs}});
}

}  // namespace upswing::machine
