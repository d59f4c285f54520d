// Checks of quantities against each other: velocities and angles, measured and commanded torques.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/text.h"
#include "machine/check.h"

namespace upswing {
namespace {

/// Sums over pairs (x, y), for the regression y ≈ offset + gain x.
struct Pairs {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;

  void Add(double a, double b) { n += 1, x += a, y += b, xx += a * a, xy += a * b, yy += b * b; }
  double Sxx() const { return xx - x * x / n; }
  double Sxy() const { return xy - x * y / n; }
  double Syy() const { return yy - y * y / n; }
  double gain() const { return Sxx() > 0 ? Sxy() / Sxx() : 0; }
  double correlation() const {
    const double product = Sxx() * Syy();
    return product > 0 ? Sxy() / std::sqrt(product) : 0;
  }
};

/// Velocities of `joint` against central differences of the angle of `other`.
Pairs VelocityPairs(Pieces pieces, int joint, int other) {
  Pairs pairs;
  for (const MachineLog& piece : pieces) {
    for (int k = 1; k + 1 < piece.rows(); ++k) {
      pairs.Add(CentralDifference(piece, k, other), piece.velocity[k][joint]);
    }
  }
  return pairs;
}

/// A gain of velocities that tells of a wrong unit.
struct WrongUnit {
  double gain;
  const char* suspect;
};
constexpr double kDegree = std::numbers::pi / 180;
constexpr WrongUnit kWrongUnits[] = {
    {1 / kDegree, "velocities in deg/s"},
    {kDegree, "angles in degrees"},
    {60 / (2 * std::numbers::pi), "velocities in rpm"},
    {kDegree * 60 / (2 * std::numbers::pi), "angles in degrees and velocities in rpm"},
    {1e3, "a clock in ms"},
    {1e6, "a clock in µs"}};

/// What a gain of the velocities means.
std::string MeaningOf(double gain) {
  for (const WrongUnit& unit : kWrongUnits) {
    if (std::abs(std::abs(gain) / unit.gain - 1) < 0.07) {
      return Concat("suspect ", unit.suspect);
    }
  }
  return gain < 0 ? "opposite sign" : "suspect the unit or a gear";
}

/// The difference of angles that the velocities of a joint are, for at least 99% of the rows; empty
/// if they are none.
std::string DifferenceOf(Pieces pieces, int joint) {
  struct Kind {
    const char* name;
    int back, ahead;  // rows
  };
  for (const Kind& kind : {Kind{"backward", 1, 0}, {"central", 1, 1}, {"forward", 0, 1}}) {
    double rows = 0, equal = 0;
    for (const MachineLog& piece : pieces) {
      for (int k = kind.back; k + kind.ahead < piece.rows(); ++k) {
        const int from = k - kind.back, to = k + kind.ahead;
        const double seconds = piece.time[to] - piece.time[from];
        const double difference = piece.angle[to][joint] - piece.angle[from][joint];
        const double v = piece.velocity[k][joint];
        rows += 1;
        equal += std::abs(v * seconds - difference) < 1e-6 * (seconds + std::abs(difference));
      }
    }
    if (rows > 10 && equal >= 0.99 * rows) return kind.name;
  }
  return "";
}

/// Finds the largest velocity where the angle moves faster.
void CheckVelocityLimit(Pieces pieces, int joint, Findings& findings) {
  double limit = 0;
  for (const MachineLog& piece : pieces) {
    for (const Joints& v : piece.velocity) limit = std::max(limit, std::abs(v[joint]));
  }
  constexpr int kRows = 5;
  std::optional<LogRows> longest;
  int times = 0;
  for (const MachineLog& piece : pieces) {
    int first = 0;
    for (int k = 1; k < piece.rows(); ++k) {
      const bool last = k + 2 >= piece.rows();
      const bool clipped = !last && std::abs(piece.velocity[k][joint]) >= limit * (1 - 1e-9) &&
                           std::abs(CentralDifference(piece, k, joint)) > 1.03 * limit;
      if (clipped) continue;
      const int rows = k - 1 - first;  // from first + 1 to k - 1
      if (rows >= kRows && ++times > 0) {
        const LogRows range = RangeOf(piece, first + 1, k - 1);
        if (!longest || range.last - range.first > longest->last - longest->first) longest = range;
      }
      first = k;
    }
  }
  if (!longest) return;
  findings.push_back({Aspect::kVelocity,
                      joint + 1,
                      Severity::kFault,
                      fmt::format("saturates at {:.4g} rad/s{}", limit,
                                  times > 1 ? fmt::format("; {} times, longest", times) : ""),
                      longest,
                      {{"limit", limit}, {"times", times}}});
}

void CheckVelocity(Pieces pieces, int joint, Findings& findings) {
  const auto add = [&](Severity severity, const std::string& text, const Pairs& pairs) {
    findings.push_back({Aspect::kVelocity,
                        joint + 1,
                        severity,
                        text,
                        {},
                        {{"gain", pairs.gain()}, {"correlation", pairs.correlation()}}});
  };
  const Pairs own = VelocityPairs(pieces, joint, joint);
  const double r = own.correlation(), gain = own.gain();
  if (AngleRange(pieces, joint) < kMoves) {
    return add(Severity::kNote, "not compared: the joint hardly moves", own);
  }
  constexpr double kAgree = 0.8, kClear = 0.9;  // correlations
  if (std::abs(r) < kAgree) {
    const Pairs other = VelocityPairs(pieces, joint, 1 - joint);
    if (std::abs(other.correlation()) > kClear && AngleRange(pieces, 1 - joint) > kMoves) {
      return add(Severity::kFault,
                 fmt::format("follows the angle of joint {}: suspect swapped columns", 2 - joint),
                 other);
    }
    return add(Severity::kWarning, fmt::format("does not follow the angle (correlation {:.2f})", r),
               own);
  }
  if (std::abs(gain - 1) > 0.3) {
    return add(Severity::kFault,
               fmt::format("{:.4g} times the change of the angle: {}", gain, MeaningOf(gain)), own);
  }
  const std::string difference = DifferenceOf(pieces, joint);
  if (!difference.empty()) {
    return add(Severity::kNote,
               fmt::format("exactly the {} difference of the angle: no measurement of its own",
                           difference),
               own);
  }
  add(std::abs(gain - 1) > 0.1 ? Severity::kWarning : Severity::kNote,
      fmt::format("{:.3f} times the change of the angle, correlation {:.3f}", gain, r), own);
}

/// A model of the measured torque: the command after a delay, a first-order lag and a gain.
struct Response {
  int rows = 0;    // delay
  double lag = 0;  // s
  Pairs pairs;     // of delayed command and measurement
  double residual() const { return 1 - std::pow(pairs.correlation(), 2); }
};

constexpr double kMostPairs = 1e5;  // rows of a fit; more take long and tell no more

/// Command of joint `from`, delayed and lagged, against the measured torque of joint `to`.
Response Respond(Pieces pieces, int from, int to, int rows, double lag) {
  Response response{rows, lag, {}};
  for (const MachineLog& piece : pieces) {
    double torque = 0;
    for (int k = rows; k < piece.rows() && response.pairs.n < kMostPairs; ++k) {
      const int sent = k - rows;
      double command = piece.commanded[sent][from];
      if (!piece.push.empty()) command += piece.push[sent][from];
      const double seconds = k > rows ? piece.time[k] - piece.time[k - 1] : 1e9;
      torque += (lag > 0 ? 1 - std::exp(-seconds / lag) : 1) * (command - torque);
      response.pairs.Add(torque, piece.measured[k][to]);
    }
  }
  return response;
}

/// The responses with the best fit of each delay.
std::vector<Response> ResponsesOf(Pieces pieces, int from, int to) {
  const double cycle = MedianCycle(pieces);
  const int most = std::clamp(static_cast<int>(std::ceil(0.05 / std::max(cycle, 1e-4))), 3, 25);
  std::vector<Response> responses;
  for (int rows = 0; rows <= most; ++rows) {
    Response best = Respond(pieces, from, to, rows, 0);
    for (const double lag : {.001, .002, .003, .004, .005, .006, .008, .01, .012, .016, .02}) {
      const Response next = Respond(pieces, from, to, rows, lag);
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

/// Reports a gain that no motor has; false if the gain is plausible.
bool CheckTorqueGain(const Response& best, int joint, Findings& findings) {
  const double gain = best.pairs.gain();
  if (gain > 1.0 / 3 && gain < 3) return false;
  const char* meaning = gain > 300 && gain < 3000    ? "suspect measured torque in mN·m"
                        : gain > 3e-4 && gain < 3e-3 ? "suspect commanded torque in mN·m"
                                                     : "suspect the unit or a gear";
  findings.push_back({Aspect::kTorque,
                      joint + 1,
                      Severity::kFault,
                      fmt::format("measured {:.3g} times commanded: {}", gain, meaning),
                      {},
                      {{"gain", gain}, {"correlation", best.pairs.correlation()}}});
  return true;
}

void CheckTorque(Pieces pieces, int joint, Findings& findings) {
  const std::vector<Response> responses = ResponsesOf(pieces, joint, joint);
  const Response best = BestOf(responses);
  constexpr double kFollows = 0.6, kClear = 0.9;  // correlations
  const double r = best.pairs.correlation(), gain = best.pairs.gain();
  if (best.pairs.Sxx() < 1e-9 * best.pairs.n) return;  // no command
  const auto add = [&](Severity severity, const std::string& text) {
    findings.push_back(
        {Aspect::kTorque,
         joint + 1,
         severity,
         text,
         {},
         {{"delay_rows", best.rows}, {"lag", best.lag}, {"gain", gain}, {"correlation", r}}});
  };
  if (best.pairs.Syy() < 1e-9 * best.pairs.n) {
    return add(Severity::kWarning, "measured torque never changes");
  }
  if (r < kFollows) {
    if (BestOf(ResponsesOf(pieces, 1 - joint, joint)).pairs.correlation() > kClear) {
      return add(Severity::kFault,
                 fmt::format("measured torque follows the command of joint {}: suspect swapped "
                             "columns",
                             2 - joint));
    }
    const double now = responses.front().pairs.correlation();
    if (now < -kFollows) {
      return add(Severity::kFault, "measured torque has the opposite sign of the command");
    }
    return add(Severity::kWarning,
               fmt::format("measured torque does not follow the command (correlation {:.2f})", r));
  }
  if (CheckTorqueGain(best, joint, findings)) return;
  // Delays with nearly the same fit.
  int low = best.rows, high = best.rows;
  for (const Response& response : responses) {
    if (response.residual() > 1.05 * best.residual() + 1e-12) continue;
    low = std::min(low, response.rows);
    high = std::max(high, response.rows);
  }
  add(Severity::kNote,
      fmt::format(
          "measured follows commanded after {} row{}{} and a lag of {:.0f} ms, gain {:.2f}, "
          "correlation {:.3f}",
          best.rows, best.rows == 1 ? "" : "s",
          low < high ? fmt::format(" ({} to {})", low, high) : "", 1e3 * best.lag, gain, r));
}

/// Reports torques that no pendulum of this kind has.
void CheckTorqueSize(Pieces pieces, int joint, Findings& findings) {
  const bool known = std::ranges::any_of(findings, [&](const Finding& finding) {
    return finding.aspect == Aspect::kTorque && finding.joint == joint + 1 &&
           finding.severity == Severity::kFault;
  });
  double largest = 0;
  for (const MachineLog& piece : pieces) {
    for (const auto* torques : {&piece.commanded, &piece.measured}) {
      for (const Joints& u : *torques) largest = std::max(largest, std::abs(u[joint]));
    }
  }
  constexpr double kLarge = 100;  // N·m
  if (known || largest <= kLarge) return;
  findings.push_back({Aspect::kTorque,
                      joint + 1,
                      Severity::kFault,
                      fmt::format("up to {:.4g} N·m: suspect mN·m", largest),
                      {},
                      {{"largest", largest}}});
}

}  // namespace

void CheckVelocities(Pieces pieces, Findings& findings) {
  if (pieces.front().velocity.empty()) return;
  for (const int joint : {0, 1}) {
    CheckVelocity(pieces, joint, findings);
    CheckVelocityLimit(pieces, joint, findings);
  }
}

void CheckTorques(Pieces pieces, Findings& findings) {
  for (const int joint : {0, 1}) {
    if (!pieces.front().commanded.empty() && !pieces.front().measured.empty()) {
      CheckTorque(pieces, joint, findings);
    }
    CheckTorqueSize(pieces, joint, findings);
  }
}

}  // namespace upswing
