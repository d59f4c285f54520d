#pragma once

#include <vector>

#include "pendulum/plant.h"
#include "runs/find_policy.h"

namespace upswing::machine {

/// A controller to choose, and the share of dry friction that motors compensate under it.
struct Candidate {
  PolicyArguments arguments;
  double compensation;
};

/// The candidates for a twin, the best first. The last two need milliseconds for a decision. They
/// plan with dry friction, because noise makes its compensation shake a light link. Damping of the
/// joint without a motor stands for its friction in the linear model of the regulator.
std::vector<Candidate> CandidatesFor(const Plant& plant);

}  // namespace upswing::machine
