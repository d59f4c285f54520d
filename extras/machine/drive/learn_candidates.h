#pragma once

#include <string>
#include <vector>

#include "agents/controllers.h"
#include "pendulum/plant.h"
#include "runs/find_policy.h"

/// The controllers among which learning chooses.
namespace upswing::machine {

/// A controller to choose.
struct Candidate {
  std::string controller;   // its name (agents/controllers.h)
  ControllerConfig config;  // with the design plant
  double compensation = 0;  // share of dry friction that motors compensate under it
};

/// The candidates for a plant, the first choice first. Their number and order are those of any
/// plant.
std::vector<Candidate> CandidatesFor(const Plant& plant);

/// The arguments that turn the defaults into the candidate, as a user gives them. GetMachinePolicy
/// designs on the twin's plant without dry friction, so changes of the plant are relative to that.
PolicyArguments ArgumentsOf(const Candidate& candidate, const Plant& plant);

}  // namespace upswing::machine
