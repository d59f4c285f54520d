#include "extras/machine/twin/physics_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/format.h"
#include "base/text.h"
#include "pendulum/equations.h"
#include "pendulum/posterior.h"

namespace upswing::machine {
namespace {

/// A machine, in a session of it, to which a rule is applied.
struct Judged {
  const Twin& twin;
  bool reports;                    // see OutsidePhysics
  std::vector<std::string> found;  // the lines so far

  template <typename... T>
  void Add(fmt::format_string<T...> format, T&&... arguments) {
    found.push_back(fmt::format(format, std::forward<T>(arguments)...));
  }
};

/// A link by its number.
struct NamedLink {
  int number;
  double mass, length, center, inertia;
};

std::vector<NamedLink> NamedLinksOf(const Plant& p) {
  return {{1, p.mass1, p.length1, p.center1, p.inertia1},
          {2, p.mass2, p.length2, p.center2, p.inertia2}};
}

void CentersAreWithinLinks(Judged& of) {
  for (const NamedLink& link : NamedLinksOf(of.twin.plant)) {
    if (link.center <= link.length) continue;
    of.Add("center{} is {:.3g} m, beyond its link of {:.3g} m", link.number, link.center,
           link.length);
  }
}

/// An inertia of 0 in a file stands for that of a capsule.
void InertiasAreThoseOfLinks(Judged& of) {
  // Of mass · length². A thin rod has 1/12; counterweights and motors add to it.
  constexpr double kFloor = 1e-4, kLargest = 4;
  for (const NamedLink& link : NamedLinksOf(of.twin.plant)) {
    const double of_end = link.mass * link.length * link.length;  // of all mass at the link's end
    const double largest = kLargest * of_end;
    const std::string name = fmt::format("inertia{}", link.number);
    const bool is_fitted = std::ranges::count(of.twin.uncertain, name) > 0;
    if (is_fitted && link.inertia < kFloor * of_end) {
      of.Add("{} is {:.2g} kg·m², as if all mass were in a point", name, link.inertia);
    }
    if (link.inertia <= largest) continue;
    of.Add("{} is {:.3g} kg·m², above the {:.3g} kg·m² of its mass at two link lengths", name,
           link.inertia, largest);
  }
}

/// Many values are 0 on some machines, such as damping. Other limits are those of no machine. The
/// rule of inertias has their floor.
void ValuesAreWithinRanges(Judged& of) {
  Twin twin = of.twin;
  const Options options = OptionsOf(twin);
  for (const std::string& name : of.twin.uncertain) {
    const Option& option = *options.Get(name);
    const Range range = UncertainRange(option);
    const double value = option.number();
    const bool is_low = value <= range.low && range.low != 0 && !name.starts_with("inertia");
    if (!is_low && value < range.high) continue;
    of.Add("{} is {:.3g} {}, at a limit of its range", name, value, option.unit);
  }
}

/// A lag delays the torque, too: slow torques tell the sum of both only. Without reports, the
/// torques of the log may be measurements. The delay then lacks their age: some milliseconds, or a
/// cycle.
void TorquesActAfterCommands(Judged& of) {
  constexpr double kRounding = 1.1;  // of a cycle
  constexpr double kOldest = 0.005;  // measurement, s
  const Actuator& actuator = of.twin.actuator;
  const double cycle = of.twin.loop.period;
  const double age = of.reports ? 0 : std::max(kOldest, cycle);
  if (actuator.delay + actuator.lag >= -kRounding * cycle - age) return;
  of.Add(
      "delay is {:.3g} ms, {:.3g} ms with the lag: torques act before the cycle of {:.3g} ms in "
      "which they are sent",
      1e3 * actuator.delay, 1e3 * (actuator.delay + actuator.lag), 1e3 * cycle);
}

/// Dry friction above gravity and the motor's torque: nothing could move the joint.
void FrictionLetsJointsMove(Judged& of) {
  const Manipulator m = ManipulatorOf(of.twin.plant);
  const auto judge = [&](int joint, double friction, double gravity) {
    const double torque = std::numbers::pi / 2 * friction;
    const double largest = std::max(gravity, of.twin.plant.torque_limit);
    if (torque <= largest) return;
    of.Add("coulomb{} is {:.3g} N·m and holds {:.3g} N·m, above gravity and the motor's {:.3g} N·m",
           joint, friction, torque, largest);
  };
  judge(1, m.f1, m.G1 + m.G2);
  judge(2, m.f2, m.G2);
}

constexpr void (*kRules[])(Judged&) = {CentersAreWithinLinks, InertiasAreThoseOfLinks,
                                       ValuesAreWithinRanges, TorquesActAfterCommands,
                                       FrictionLetsJointsMove};

std::vector<std::string> LinesOf(const Twin& twin, bool reports) {
  Judged judged{twin, reports, {}};
  for (const auto rule : kRules) rule(judged);
  return judged.found;
}

}  // namespace

std::vector<std::string> OutsidePhysics(const Twin& twin, bool reports) {
  std::vector<std::string> lines = LinesOf(twin, reports);
  for (const Session& session : twin.sessions) {
    Twin own = twin;
    const Options options = OptionsOf(own);
    for (const auto& [setting, number] : session.values) {
      *std::get<double*>(options.Get(setting)->target) = number;
    }
    for (const std::string& line : LinesOf(own, reports)) {
      // A value that no session changes is in the lines of the machine.
      if (std::ranges::find(lines, line) != lines.end()) continue;
      lines.push_back(twin.sessions.size() == 1 ? line
                                                : Concat("session ", session.name, ": ", line));
    }
  }
  return lines;
}

}  // namespace upswing::machine
