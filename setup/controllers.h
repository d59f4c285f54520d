#pragma once

#include <memory>
#include <string>
#include <vector>

#include "control/settings.h"
#include "core/policy.h"
#include "sim/double_pendulum.h"

/// Controllers that are made from the equations of motion. Where a command takes a policy's file,
/// it takes the name of one of these.
namespace upswing {

/// How they are made.
struct ControllerConfig {
  Plant plant;  // what for
  LqrConfig lqr;
  SwingUpConfig tvlqr;
  MpcConfig mpc;
  EnergyShapingConfig energy;
  PartialFeedbackConfig pfl;
  std::string swing_up;  // of `hybrid`: what names the policy that swings up
  std::shared_ptr<const Policy> swing_up_policy;  // that policy; not a setting

  /// The settings but the plant, which has flags of its own.
  void Describe(Options& options);
};

/// Their names, in alphabetical order.
std::vector<std::string> ControllerNames();

bool IsController(const std::string& name);

/// Whether a controller holds the pendulum upright and does not swing it up.
bool OnlyBalances(const std::string& name);

/// Whether a controller has the settings of this section: its own, and those of lqr, on which all
/// build.
bool HasSection(const std::string& controller, const std::string& section);

/// Throws BadInput if there is no controller of this name, or none for this plant.
std::shared_ptr<const Policy> MakeController(const std::string& name,
                                             const ControllerConfig& config);

/// Its name with what is not at its default: `lqr (lqr_torque 0.1, for mass2 1.2)`.
std::string TitleOf(const std::string& name, const ControllerConfig& config);

}  // namespace upswing
