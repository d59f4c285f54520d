// Hypotheses in words.
#include <fmt/format.h>

#include <cmath>

#include "base/format.h"
#include "extras/machine/logs/hypotheses.h"

namespace upswing::machine {
namespace {

/// The factor of an angle, in words.
std::string ScaleText(double scale) {
  if (std::abs(scale - kFullTurn) < 1e-9) return "turns (key unit)";
  if (std::abs(scale - kOneDegree) < 1e-9) return "degrees (key unit)";
  return fmt::format(
      "an angle of {:.3g} times the true one: the counts of the encoder, a belt or a gear "
      "(factor = {:.4g})",
      1 / scale, scale);
}

/// A change of an encoder or a torque during the log. `seconds`: length of the log.
Suspicion SuspicionOfChange(const Hypothesis& h, double seconds) {
  const Eigen::VectorXd& x = h.fit.constants;
  if (h.change.kind == Change::kOffset) {
    const int joint = h.change.joint;
    const double effect = x(joint == 0 ? weak::kTorque1 : weak::kTorque2);
    return {Aspect::kTorque, joint + 1,
            fmt::format("an offset of {} N·m",
                        FormatPlain(effect > 0 ? -x(weak::kColumns) / effect : 0, 2))};
  }
  if (h.change.kind == Change::kClock) {
    const double rate = h.change.rate;
    return {Aspect::kClock, 0,
            fmt::format("a clock that runs {} {} after {} s than before",
                        FormatPercent(std::abs(rate - 1)), rate > 1 ? "faster" : "slower",
                        FormatPlain(h.change.place * seconds, 3))};
  }
  const Joints more = h.more_turn();
  const Joints slip{-h.angles.turn[0] - more[0], -h.angles.turn[1] - more[1]};
  const bool is_first = std::abs(slip[0]) > std::abs(slip[1]);
  const double turn = slip[is_first ? 0 : 1];
  const std::string text =
      h.change.kind == Change::kSlip
          ? fmt::format("an encoder that slips by {} rad near {} s", FormatPlain(turn, 2),
                        FormatPlain(h.change.place * seconds, 3))
          : fmt::format("an encoder that drifts by {} rad/s", FormatPlain(turn / seconds, 2));
  return {Aspect::kAngle, is_first ? 1 : 2, text};
}

}  // namespace

std::vector<Suspicion> SuspicionsOf(const Hypothesis& h, double seconds) {
  std::vector<Suspicion> all;
  const auto add = [&](Aspect aspect, int joint, const std::string& text) {
    all.push_back({aspect, joint, text});
  };
  const AngleReading& r = h.angles;
  const TorqueReading& t = h.torques;
  const bool is_absolute = r.absolute || r.link1 > 0;
  if (r.swapped && t.swapped) add(Aspect::kMotion, 0, "swapped columns of both joints");
  if (r.swapped && !t.swapped) add(Aspect::kAngle, 0, "swapped angles");
  if (!r.swapped && t.swapped) add(Aspect::kTorque, 0, "swapped torques");
  if (r.link1 != 0) {
    add(Aspect::kAngle, 2,
        r.link1 > 0 ? "an angle against the vertical (key absolute)"
                    : "an angle against link 1 (without key absolute)");
  }
  if (r.late != 0) {
    add(Aspect::kAngle, 2,
        fmt::format("angles that are {} ms {} than those of joint 1",
                    FormatPlain(1e3 * std::abs(r.late), 2), r.late > 0 ? "later" : "earlier"));
  }
  for (const int j : {0, 1}) {
    if (std::abs(r.scale[j]) != 1) add(Aspect::kAngle, j + 1, ScaleText(std::abs(r.scale[j])));
    if (r.scale[j] < 0) add(Aspect::kAngle, j + 1, "the opposite sign (factor = -1)");
    if (t.sign[j] < 0) add(Aspect::kTorque, j + 1, "the opposite sign (factor = -1)");
    if (std::abs(r.zero[j]) <= kZero) continue;
    // The reading of a link that hangs, by the column's own sign.
    const double hangs = -std::copysign(1.0, r.scale[j]) *
                         (j == 1 && is_absolute ? r.zero[1] + r.zero[0] : r.zero[j]);
    const double zero = std::remainder(hangs, kFullTurn);
    add(Aspect::kAngle, j + 1,
        fmt::format("another zero, {:.2f} rad ({:.0f} deg) when its link {} (add it to the key "
                    "hanging, in the column's unit)",
                    zero, zero / kOneDegree,
                    j == 0 || is_absolute ? "hangs" : "is in line with link 1"));
  }
  if (h.is_late) {
    add(Aspect::kTorque, 0,
        fmt::format("torques that are {} ms {} than they act",
                    FormatPlain(1e3 * std::abs(h.delay), 2), h.delay > 0 ? "earlier" : "later"));
  }
  for (const int j : {0, 1}) {
    if (t.largest[j] > 0) {
      add(Aspect::kTorque, j + 1,
          fmt::format("motors that saturate near {} N·m", FormatPlain(t.largest[j], 2)));
    }
    if (t.dead_band[j] > 0) {
      add(Aspect::kTorque, j + 1,
          fmt::format("a dead band of about {} N·m", FormatPlain(t.dead_band[j], 2)));
    }
  }
  if (t.flips_at >= 0) {
    add(Aspect::kTorque, 0,
        fmt::format("a sign that turns near {} s", FormatPlain(t.flips_at * seconds, 3)));
  }
  if (h.change.kind != Change::kNone) all.push_back(SuspicionOfChange(h, seconds));
  return all;
}

std::string SentenceOf(const std::vector<Suspicion>& suspicions) {
  std::string text;
  for (const Suspicion& s : suspicions) {
    if (!text.empty()) text += " and ";
    text += s.joint > 0 ? fmt::format("{} {}: {}", NameOf(s.aspect), s.joint, s.text) : s.text;
  }
  return text;
}

}  // namespace upswing::machine
