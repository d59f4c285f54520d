#include "extras/machine/learning_candidates.h"

#include "base/text.h"

namespace upswing::machine {

std::vector<Candidate> CandidatesFor(const Plant& plant) {
  const auto with = [](const char* name, const std::vector<FlagValue>& flags) {
    constexpr double kUsual = 0.95;
    Candidate c{{}, kUsual};
    c.arguments.name = name;
    c.arguments.flags = flags;
    return c;
  };
  const std::vector<FlagValue> stiff{{"lqr_q1", "100"}, {"lqr_q2", "100"}, {"lqr_torque", "0.3"}};
  std::vector<FlagValue> ahead = stiff;
  ahead.insert(ahead.end(), {{"mpc_seconds", "0.3"}, {"mpc_angle_range", "9"}});
  Candidate rubbing = with("mpc", {{"mpc_seconds", "1"}});
  rubbing.compensation = 0;
  rubbing.arguments.made_for = {Concat("coulomb1=", plant.coulomb1),
                                Concat("coulomb2=", plant.coulomb2)};
  Candidate damped = rubbing;
  constexpr double kDamping = 2;  // for dry friction, s/rad
  damped.arguments.made_for.push_back(
      plant.actuated_joint == 1 ? Concat("damping2=", plant.damping2 + kDamping * plant.coulomb2)
                                : Concat("damping1=", plant.damping1 + kDamping * plant.coulomb1));
  return {with("tvlqr", {}),
          with("tvlqr", stiff),
          with("tvlqr", {{"tvlqr_seconds", "6"}, {"tvlqr_reserve", "0.1"}}),
          with("mpc", ahead),
          rubbing,
          damped};
}

}  // namespace upswing::machine
