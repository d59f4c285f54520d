// Checks of the measured torque against the commanded one.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/format.h"
#include "extras/machine/logs/check.h"

namespace upswing::machine {
namespace {

/// A model of the measured torque: the command after a delay, a first-order lag and a gain.
struct Response {
  int rows = 0;    // delay
  double lag = 0;  // s
  Pairs pairs;     // of delayed command and measurement
  double residual() const { return 1 - std::pow(pairs.correlation(), 2); }
};

/// Acceleration of a joint at row k from the angles `span` rows before and after, rad/s²; 0 if the
/// clock stands still.
double AccelerationAt(const MachineLog& log, int k, int joint, int span) {
  const double before = log.time[k] - log.time[k - span], after = log.time[k + span] - log.time[k];
  if (!(before > 0) || !(after > 0)) return 0;
  const double slower = (log.angle[k][joint] - log.angle[k - span][joint]) / before;
  const double faster = (log.angle[k + span][joint] - log.angle[k][joint]) / after;
  return 2 * (faster - slower) / (before + after);
}

constexpr double kMostPairs = 1e5;  // rows of a fit; more would only take longer

/// Command of joint `from`, delayed and lagged, against the measured torque of joint `to`.
/// `cycle`: usual one, s. `is_swapped`: the measured torque as the command.
Response Respond(Pieces pieces, double cycle, int from, int to, int rows, double lag,
                 bool is_swapped) {
  constexpr double kLost = 0.5;  // cycles, after which a delay in rows is another one in time
  Response response{rows, lag, {}};
  for (const MachineLog& piece : pieces) {
    const std::vector<Joints>& in = is_swapped ? piece.measured : piece.commanded;
    const std::vector<Joints>& out = is_swapped ? piece.commanded : piece.measured;
    double torque = 0;
    for (int k = rows; k < piece.rows() && response.pairs.n < kMostPairs; ++k) {
      const int sent = k - rows;
      double command = in[sent][from];
      if (!piece.push.empty()) command += piece.push[sent][from];
      const double seconds = k > rows ? piece.time[k] - piece.time[k - 1] : 1e9;
      torque += (lag > 0 ? 1 - std::exp(-seconds / lag) : 1) * (command - torque);
      if (piece.time[k] - piece.time[sent] > (rows + kLost) * cycle) continue;
      response.pairs.Add(torque, out[k][to]);
    }
  }
  return response;
}

/// The responses with the best fit of each delay.
std::vector<Response> ResponsesOf(Pieces pieces, int from, int to, bool is_swapped = false) {
  const double cycle = UsualCycle(pieces);
  const int most = std::clamp(static_cast<int>(std::ceil(0.05 / std::max(cycle, 1e-4))), 3, 25);
  std::vector<Response> responses;
  for (int rows = 0; rows <= most; ++rows) {
    Response best = Respond(pieces, cycle, from, to, rows, 0, is_swapped);
    for (const double lag : {.001, .002, .003, .004, .005, .006, .008, .01, .012, .016, .02}) {
      const Response next = Respond(pieces, cycle, from, to, rows, lag, is_swapped);
      if (next.pairs.correlation() > best.pairs.correlation()) best = next;
    }
    responses.push_back(best);
  }
  return responses;
}

Response BestOf(const std::vector<Response>& responses) {
  return *std::ranges::max_element(responses, {},
                                   [](const Response& r) { return r.pairs.correlation(); });
}

/// `2 rows (1 to 3)`: the best delay, and the delays with nearly the same fit.
std::string DelayText(const std::vector<Response>& responses, const Response& best) {
  int low = best.rows, high = best.rows;
  for (const Response& response : responses) {
    if (response.residual() > 1.05 * best.residual() + 1e-12) continue;
    low = std::min(low, response.rows);
    high = std::max(high, response.rows);
  }
  const std::string rows = Counted(best.rows, "row");
  return low < high ? fmt::format("{} ({} to {})", rows, low, high) : rows;
}

/// Reports a gain that no motor has. Returns whether it does.
bool ReportsImplausibleGain(const Response& best, const Reporter& report) {
  const double gain = best.pairs.gain();
  if (gain > 1.0 / 3 && gain < 3) return false;
  const char* meaning = "suspect the unit or a gear";
  if (gain > 300 && gain < 3000) meaning = "suspect measured torque in mN·m";
  if (gain > 3e-4 && gain < 3e-3) meaning = "suspect commanded torque in mN·m";
  report(Severity::kFault, fmt::format("measured {:.3g} times commanded: {}", gain, meaning), {},
         {{"gain", gain}, {"correlation", best.pairs.correlation()}});
  return true;
}

/// Root mean square of a joint's torques, N·m.
double RmsOf(Pieces pieces, std::vector<Joints> MachineLog::*quantity, int joint) {
  double squares = 0;
  const std::vector<double> torques = ValuesOf(pieces, quantity, joint);
  for (const double torque : torques) squares += torque * torque;
  return torques.empty() ? 0 : std::sqrt(squares / static_cast<double>(torques.size()));
}

/// Time in which a joint has a command or a push, s.
double CommandedSeconds(Pieces pieces, int joint) {
  double seconds = 0;
  for (const MachineLog& piece : pieces) {
    for (int k = 0; k + 1 < piece.rows(); ++k) {
      const bool acts =
          piece.commanded[k][joint] != 0 || (!piece.push.empty() && piece.push[k][joint] != 0);
      if (acts) seconds += piece.time[k + 1] - piece.time[k];
    }
  }
  return seconds;
}

/// Whether the command of a joint is more than a rounding error of the other joint's.
bool IsDriven(Pieces pieces, int joint) {
  constexpr double kShare = 0.02;
  return HasCommand(pieces, joint) && RmsOf(pieces, &MachineLog::commanded, joint) >
                                          kShare * RmsOf(pieces, &MachineLog::commanded, 1 - joint);
}

/// Pairs of a joint's acceleration (rad/s²) and its measured torque in the rows without a command.
Pairs IdlePairs(Pieces pieces, int joint, int span) {
  Pairs pairs;
  for (const MachineLog& piece : pieces) {
    for (int k = span; k + span < piece.rows(); ++k) {
      const bool idle = piece.commanded[k - 1][joint] == 0 && piece.commanded[k][joint] == 0 &&
                        (piece.push.empty() || piece.push[k][joint] == 0);
      if (idle) pairs.Add(AccelerationAt(piece, k, joint, span), piece.measured[k][joint]);
    }
  }
  return pairs;
}

constexpr double kFollows = 0.6, kClear = 0.9, kBetter = 0.02;  // correlations

/// Reports a finding with the numbers of a response.
void ReportResponse(const Reporter& report, Severity severity, const std::string& text,
                    const Response& response) {
  report(severity, text, {},
         {{"delay_rows", response.rows},
          {"lag", response.lag},
          {"gain", response.pairs.gain()},
          {"correlation", response.pairs.correlation()}});
}

/// Reports a command or a measurement that never changes. Returns whether there is no response to
/// judge: one of them never changes, or the command is too short.
bool LacksResponse(Pieces pieces, int joint, const Response& best, const Reporter& report) {
  const double least = 1e-9 * best.pairs.n;
  if (!(best.pairs.Sxx() > least)) {
    if (ActsWithoutCommand(pieces, joint)) {
      ReportResponse(report, Severity::kFault,
                     fmt::format("measured torque of {:.2g} N·m (rms) without a command",
                                 RmsOf(pieces, &MachineLog::measured, joint)),
                     best);
    }
    return true;
  }
  constexpr double kLongEnough = 0.1;  // s; a shorter command says nothing
  if (CommandedSeconds(pieces, joint) < kLongEnough) return true;
  if (best.pairs.Syy() > least) return false;
  ReportResponse(report, IsDriven(pieces, joint) ? Severity::kFault : Severity::kWarning,
                 "measured torque never changes: suspect a column without a measurement (leave it "
                 "out by --columns)",
                 best);
  return true;
}

/// Reports columns that are swapped between the joints, or between commands and measurements. The
/// numbers are of the response with the columns swapped back. Returns whether they are swapped.
bool ReportsSwappedTorques(Pieces pieces, int joint, const Response& best, const Reporter& report) {
  const double r = best.pairs.correlation();
  if (r < kClear) {
    const Response other = BestOf(ResponsesOf(pieces, 1 - joint, joint));
    if (other.pairs.correlation() > std::max(kClear, r + kBetter)) {
      const int number = joint == 0 ? 2 : 1;
      ReportResponse(report, Severity::kFault,
                     fmt::format("measured torque follows the command of joint {}: suspect swapped "
                                 "columns",
                                 number),
                     other);
      return true;
    }
  }
  constexpr double kWorse = 1.3;  // residual
  const Response back = BestOf(ResponsesOf(pieces, joint, joint, /*is_swapped=*/true));
  const bool is_swapped = best.rows == 0 && back.rows > 0 &&
                          best.residual() > kWorse * back.residual() &&
                          back.pairs.correlation() > kFollows;
  if (is_swapped) {
    ReportResponse(report, Severity::kFault,
                   fmt::format("commanded follows measured after {}: suspect swapped columns",
                               Counted(back.rows, "row")),
                   back);
  }
  return is_swapped;
}

/// Reports a measurement that does not follow the command, unless the joint is only pushed by hand.
/// Returns whether it does not follow.
bool DoesNotFollow(Pieces pieces, int joint, const std::vector<Response>& responses,
                   const Response& best, const Reporter& report) {
  const double r = best.pairs.correlation();
  if (r >= kFollows) return false;
  if (!HasCommand(pieces, joint)) return true;
  const Response& without_delay = responses.front();
  if (without_delay.pairs.correlation() < -kFollows) {
    ReportResponse(report, Severity::kFault, "measured torque has the opposite sign of the command",
                   best);
  } else {
    ReportResponse(
        report, Severity::kWarning,
        fmt::format("measured torque does not follow the command (correlation {:.2f})", r), best);
  }
  return true;
}

void CheckTorque(Pieces pieces, int joint, const Reporter& report) {
  const std::vector<Response> responses = ResponsesOf(pieces, joint, joint);
  const Response best = BestOf(responses);
  if (LacksResponse(pieces, joint, best, report)) return;
  if (ReportsSwappedTorques(pieces, joint, best, report)) return;
  if (DoesNotFollow(pieces, joint, responses, best, report)) return;
  if (ReportsImplausibleGain(best, report)) return;
  const double r = best.pairs.correlation(), gain = best.pairs.gain();
  constexpr double kProportional = 0.95, kLow = 0.6, kHigh = 1.6;  // correlation, gains
  const bool is_odd = r > kProportional && (gain < kLow || gain > kHigh);
  std::string text = fmt::format(
      "measured follows commanded after {} and a lag of {:.0f} ms, gain {:.2f}, correlation {:.3f}",
      DelayText(responses, best), 1e3 * best.lag, gain, r);
  // Real motors give less than their command, but then their torques follow it less exactly.
  constexpr double kExact = 0.995, kOff = 0.1;  // correlation, of the gain
  const bool is_scaled = r > kExact && std::abs(gain - 1) > kOff;
  if (is_odd) {
    text += ": suspect one of them in amperes or another unit (key factor)";
  } else if (is_scaled) {
    text += ": the motors give another torque than commanded (key factor of commanded)";
  }
  ReportResponse(report, is_odd || is_scaled ? Severity::kWarning : Severity::kNote, text, best);
}

/// Reports torques that no pendulum of this kind has, and commands that end at 1 exactly.
void CheckTorqueSize(Pieces pieces, int joint, const Reporter& report) {
  const bool known = std::ranges::any_of(report.findings, [&](const Finding& finding) {
    return finding.aspect == Aspect::kTorque && finding.joint == joint + 1 &&
           finding.severity == Severity::kFault;
  });
  if (known) return;
  double largest = 0;
  int ones = 0;
  for (const auto quantity : {&MachineLog::commanded, &MachineLog::measured}) {
    for (const double u : ValuesOf(pieces, quantity, joint)) {
      largest = std::max(largest, std::abs(u));
      if (quantity == &MachineLog::commanded && std::abs(u) == 1) ++ones;
    }
  }
  constexpr double kLarge = 100;  // N·m
  constexpr int kOften = 3;
  const Numbers numbers{{"largest", largest}};
  if (largest > kLarge) {
    report(Severity::kWarning,
           fmt::format("up to {:.4g} N·m: suspect mN·m if the machine is not that strong", largest),
           {}, numbers);
  } else if (largest == 1 && ones >= kOften) {
    report(
        Severity::kWarning,
        "ends at 1 exactly: suspect a command between -1 and 1, whose factor is the torque limit",
        {}, numbers);
  }
}

}  // namespace

bool ActsWithoutCommand(Pieces pieces, int joint) {
  constexpr double kActs = 0.5;   // N·m, rms, of a machine without any command
  constexpr double kShare = 0.5;  // of the other joint's
  if (HasCommand(pieces, joint)) return false;
  const double own = RmsOf(pieces, &MachineLog::measured, joint);
  const double other = std::max(RmsOf(pieces, &MachineLog::measured, 1 - joint),
                                RmsOf(pieces, &MachineLog::commanded, 1 - joint));
  return own > (HasCommand(pieces, 1 - joint) ? kShare * other : std::max(kActs, kShare * other));
}

std::vector<MachineLog> WithoutRotors(Pieces pieces) {
  constexpr double kIdle = 0.2, kFollowsAcceleration = 0.5;  // share of the rows, correlation
  std::vector<MachineLog> logs(pieces.begin(), pieces.end());
  if (logs.front().commanded.empty() || logs.front().measured.empty()) return logs;
  const double cycle = UsualCycle(pieces);
  if (!(cycle > 0)) return logs;
  const int span = std::max(1, static_cast<int>(std::lround(0.01 / cycle)));
  double rows = 0;
  for (const MachineLog& log : logs) rows += log.rows();
  for (const int joint : {0, 1}) {
    if (!HasCommand(pieces, joint)) continue;
    const Pairs idle = IdlePairs(pieces, joint, span);
    if (idle.n < kIdle * rows || idle.correlation() > -kFollowsAcceleration) continue;
    for (MachineLog& log : logs) {
      for (int k = span; k + span < log.rows(); ++k) {
        log.measured[k][joint] -= idle.gain() * AccelerationAt(log, k, joint, span);
      }
    }
  }
  return logs;
}

void CheckTorques(Pieces pieces, Findings& findings) {
  for (const int joint : {0, 1}) {
    const Reporter report{findings, Aspect::kTorque, joint + 1};
    if (!pieces.front().commanded.empty() && !pieces.front().measured.empty()) {
      CheckTorque(pieces, joint, report);
    }
    CheckTorqueSize(pieces, joint, report);
  }
}

}  // namespace upswing::machine
