#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "base/text.h"
#include "pendulum/task.h"

/// Goals other than upright: the poses in which the pendulum can rest.
namespace upswing {

/// Which links point up. Upright by default.
struct Pose {
  bool up1 = true, up2 = true;

  bool operator==(const Pose&) const = default;
};
inline constexpr std::array<Pose, 4> kPoses{Pose{true, true}, Pose{true, false}, Pose{false, true},
                                            Pose{false, false}};

/// The name of a pose, such as "up-down": link 1 up, link 2 down.
inline std::string PoseName(const Pose& pose) {
  return Concat(pose.up1 ? "up-" : "down-", pose.up2 ? "up" : "down");
}

/// The names of all poses, in the order of kPoses.
inline std::vector<std::string> PoseNames() {
  std::vector<std::string> names;
  for (const Pose& pose : kPoses) names.push_back(PoseName(pose));
  return names;
}

/// The state with its angles measured from `pose` in place of upright: rest in the pose becomes
/// rest upright.
inline PendulumState SeenFrom(const Pose& pose, const PendulumState& s) {
  const double turn1 = pose.up1 ? 0 : std::numbers::pi;
  const double turn12 = pose.up2 ? 0 : std::numbers::pi;
  return {s.q1 + turn1, s.q2 + turn12 - turn1, s.w1, s.w2};
}

/// Rest in a pose, off it as `off` is off hanging.
inline PendulumState RestIn(const Pose& pose, const PendulumState& off = {}) {
  return SeenFrom({!pose.up1, !pose.up2}, off);  // turns each link that points up by half
}

/// The reward's terms with `goal` in place of upright: those of the state seen from it, but the
/// energy term is 1 - |Ê - Ê at rest in the goal|, or 0 if that is negative.
inline std::array<double, kRewardTerms> RewardTerms(const Plant& plant, const PendulumState& s,
                                                    double tau, const Pose& goal,
                                                    const Scale& scale = {}) {
  auto terms = RewardTerms(plant, SeenFrom(goal, s), tau, scale);
  const double missing = NormalizedEnergy(plant, s) - NormalizedEnergy(plant, RestIn(goal));
  terms[0] = std::max(0.0, 1 - std::abs(missing));
  return terms;
}

}  // namespace upswing
