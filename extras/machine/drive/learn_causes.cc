#include "extras/machine/drive/learn_causes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/error.h"
#include "base/format.h"
#include "extras/machine/drive/learn_candidates.h"
#include "extras/machine/drive/learn_trials.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/logs/play.h"
#include "extras/machine/twin/motion.h"
#include "pendulum/runge_kutta.h"
#include "pendulum/scale.h"

namespace upswing::machine {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// The dry friction of a joint, and what it holds.
struct HeldLink {
  double torque;  // largest torque of the friction, N·m
  double angle;   // largest angle from hanging at which it holds the link, rad
};

HeldLink HeldLinkOf(double friction, double gravity) {
  const double torque = std::numbers::pi / 2 * friction;
  return {torque, torque < gravity ? std::asin(torque / gravity) : std::numbers::pi};
}

/// Dry friction that keeps links from hanging.
void AddFriction(const SessionFacts& facts, std::vector<std::string>& causes) {
  constexpr double kNotable = 15 * kDegree;
  const Manipulator m = ManipulatorOf(facts.twin.plant);
  const HeldLink links[2] = {HeldLinkOf(m.f1, m.G1 + m.G2), HeldLinkOf(m.f2, m.G2)};
  for (int j = 0; j < 2; ++j) {
    const HeldLink& link = links[j];
    if (link.angle < kNotable) continue;
    std::string text = fmt::format(
        "dry friction of joint {} holds {} N·m, so that its link stands still up to {:.0f}° "
        "from hanging",
        j + 1, FormatPlain(link.torque, 2), link.angle / kDegree);
    const double compensated = facts.config.limits.passive_torque;
    if (j + 1 != facts.config.actuated_joint && compensated < link.torque) {
      text += fmt::format(", and --passive-torque compensates {} N·m", FormatPlain(compensated, 2));
    }
    causes.push_back(text);
  }
}

/// A machine like the twin without one of its difficulties.
struct Relief {
  const char* text;
  LearnConfig config;
  Twin twin;
};

std::vector<Relief> ReliefsOf(const SessionFacts& facts) {
  std::vector<Relief> reliefs;
  const auto add = [&](const char* text) -> Relief& {
    return reliefs.emplace_back(Relief{text, facts.config, facts.twin});
  };
  Limits& limits = add("without your limits of angle, velocity and energy").config.limits;
  constexpr double kWide = 10;  // times the limits
  for (double Limits::*limit : {&Limits::angle, &Limits::velocity, &Limits::energy}) {
    limits.*limit *= kWide;
  }
  Relief& smooth = add("without dry friction");
  smooth.twin.plant.coulomb1 = smooth.twin.plant.coulomb2 = 0;
  Relief& strong = add("with twice the torque");
  strong.config.limits.torque *= 2;
  strong.twin.plant.torque_limit *= 2;
  Relief& quick = add("with motors that answer at once");
  quick.twin.actuator.delay = quick.twin.actuator.lag = 0;
  return reliefs;
}

/// Most machines of the twin that one of the quick candidates balances.
int MostHeld(const LearnConfig& config, const Twin& twin) {
  constexpr int kQuick = 3;  // candidates without mpc
  const std::vector<Candidate> candidates = CandidatesFor(twin.plant);
  int most = 0;
  for (int i = 0; i < kQuick && most < kDraws; ++i) {
    const Candidate& candidate = candidates[i];
    try {
      const MachinePolicy policy =
          GetMachinePolicy(ArgumentsOf(candidate, twin.plant), "", twin, std::llround(config.hz));
      most = std::max(most, HeldBy(config, {.twin = twin}, policy, candidate.compensation,
                                   [] { return false; }));
    } catch (const Error&) {
      // No such controller exists for this machine.
    }
  }
  return most;
}

/// Difficulties that keep even simulated machines of the twin from balance.
void AddDifficulties(const SessionFacts& facts, std::vector<std::string>& causes) {
  constexpr int kMost = kDraws - 1;
  const bool is_easy = std::ranges::any_of(
      facts.tries, [](const FailedTry& failure) { return failure.held >= kMost; });
  if (is_easy || MostHeld(facts.config, facts.twin) >= kMost) return;
  std::string found;
  for (const Relief& relief : ReliefsOf(facts)) {
    if (MostHeld(relief.config, relief.twin) < kMost) continue;
    found += fmt::format("{}{}", found.empty() ? "" : " or ", relief.text);
  }
  if (!found.empty()) causes.push_back("simulated machines of the twin balance only " + found);
}

/// A machine that differs from the twin, although the twin explains its logs.
void AddDifference(const SessionFacts& facts, std::vector<std::string>& causes) {
  int held = 0;
  double balanced = 0;
  for (const FailedTry& failure : facts.tries) {
    held = std::max(held, failure.held);
    balanced = std::max(balanced, failure.balanced);
  }
  if (held < kDraws - 1) return;
  causes.push_back(fmt::format(
      "{} of {} simulated machines of the twin balance, and the machine stands for {:.1f} s at "
      "most: look for play of a gear or a coupling, elastic links and a loose base, which no twin "
      "has",
      held, kDraws, balanced));
}

/// The natural time of the machine, s: that of the twin, or of the machine that the user knows.
double NaturalTimeOf(const SessionFacts& facts) {
  const bool is_trusted = facts.twin.distrust.empty();
  return NaturalUnits(is_trusted ? facts.twin.plant : facts.config.Known().plant).time;
}

/// Play that explains the motion. Returns whether there is some.
bool AddPlay(const SessionFacts& facts, std::vector<std::string>& causes) {
  const std::optional<Play> play = FindPlay(facts.logs, NaturalTimeOf(facts),
                                            facts.twin.actuator.delay, facts.config.actuated_joint);
  if (!play) return false;
  // Links that move by less than the play show none.
  const double range = std::max(AngleRange(facts.logs, 0), AngleRange(facts.logs, 1));
  if (range < 2 * play->width) return false;
  const char* where = play->kind == PlayKind::kEncoder ? "between the link and its encoder"
                                                       : "of the gear before the link";
  causes.push_back(fmt::format(
      "suspect play of about {:.1g} rad at joint {}, {}: with it the equations of a pendulum "
      "leave {} of the motion unexplained, without it {}",
      play->width, play->joint, where, FormatPercent(play->left),
      FormatPercent(play->left_without)));
  return true;
}

/// Whether the encoders of both joints have shown a motion.
bool HasMoved(const SessionFacts& facts) {
  constexpr double kLeast = 0.05;  // rad
  return AngleRange(facts.logs, 0) > kLeast && AngleRange(facts.logs, 1) > kLeast;
}

/// Faults of the logs, by the checks that need no model. Play looks like an encoder that sticks.
void AddFaultsOfLogs(const SessionFacts& facts, bool has_play, std::vector<std::string>& causes) {
  for (const Finding& finding : CheckLog("", facts.logs).findings) {
    if (finding.severity != Severity::kFault) continue;
    if (has_play && finding.aspect == Aspect::kAngle) continue;
    causes.push_back(AboutText(finding) + ": " + finding.text);
  }
}

}  // namespace

std::vector<std::string> CausesOf(const SessionFacts& facts) {
  std::vector<std::string> causes;
  const bool has_play = AddPlay(facts, causes);
  // If a twin explains the logs, they have no faults.
  const bool is_explained = facts.is_identified && facts.twin.distrust.empty();
  if (!is_explained) AddFaultsOfLogs(facts, has_play, causes);
  if (facts.is_identified) {
    if (!is_explained) causes.push_back(facts.twin.distrust);
    AddFriction(facts, causes);
  }
  if (facts.is_faulty && causes.empty() && HasMoved(facts)) {
    causes.emplace_back("play of a gear or a coupling looks like this, too");
  }
  if (facts.is_faulty || !facts.is_identified) return causes;
  AddDifficulties(facts, causes);
  if (causes.empty()) AddDifference(facts, causes);
  return causes;
}

std::vector<std::string> FallsBeyond(const Twin& twin, const Limits& limits) {
  constexpr double kLean = 0.1;                                // rad
  const double seconds = 3 * ScaleOverUsual(twin.plant).time;  // of each fall
  const Body body = BodyOf(twin);
  const auto falling = [&](const PendulumState& s, double /*share*/) {
    return body.Acceleration(s, {});
  };
  double angle = 0, velocity = 0;
  for (const double lean : {-kLean, kLean}) {
    PendulumState s{std::numbers::pi + lean, 0, 0, 0};
    for (int i = 0; i < seconds / body.longest_step; ++i) {
      s = RungeKuttaStep(s, falling(s, 0), body.longest_step, falling);
      angle = std::max(angle, LargerMagnitude(s.q1, s.q2));
      velocity = std::max(velocity, LargerMagnitude(s.w1, s.w2));
    }
  }
  std::vector<std::string> falls;
  const auto compare = [&](const char* flag, double limit, double reached, const char* unit) {
    if (reached <= limit) return;
    falls.push_back(fmt::format("a fall from upright reaches {:.1f} {}, beyond {} {:g}", reached,
                                unit, flag, limit));
  };
  compare("--max-angle", limits.angle, angle, "rad");
  compare("--max-velocity", limits.velocity, velocity, "rad/s");
  return falls;
}

}  // namespace upswing::machine
