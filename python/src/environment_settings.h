#pragma once

#include <vector>

#include "judge/trial.h"
#include "setup/config.h"

namespace upswing {

/// Whether a setting of a training is one of its environments too.
bool IsEnvironmentSetting(const Option& option);

/// The settings of environments: those of the named agent (the usual one if none is named) with
/// these changes. Throws BadInput for settings that environments do not have.
Config EnvironmentConfig(const std::vector<FlagValue>& flags);

/// Plant, sensors and motor that a policy is tried on.
struct TrialSurroundings {
  Plant plant;
  TrialConditions conditions;

  void Describe(Options& o) {
    plant.Describe(o);
    conditions.Describe(o);
  }
};

/// Sets what the flags say of them. Throws BadInput.
void SetSurroundings(const std::vector<FlagValue>& flags, TrialArguments& trial);

}  // namespace upswing
