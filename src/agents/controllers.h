#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/policy.h"
#include "control/settings.h"
#include "pendulum/plant.h"

/// Controllers that are designed from the equations of motion. Commands that take a policy file
/// also take the name of a controller.
namespace upswing {

/// Settings of all controllers.
struct ControllerConfig {
  Plant plant;  // design plant
  LqrConfig lqr;
  SwingUpConfig tvlqr;
  MpcConfig mpc;
  EnergyShapingConfig energy;
  PartialFeedbackConfig pfl;
  std::string swing_up;                           // for `hybrid`: name of the policy that swings up
  std::shared_ptr<const Policy> swing_up_policy;  // the loaded swing_up policy; not a setting

  /// Describes all settings except the plant, which has its own flags.
  void Describe(Options& options);
};

/// Names of the controllers, in alphabetical order.
std::vector<std::string> ControllerNames();

bool IsController(const std::string& name);

/// Whether a controller only holds the pendulum upright and cannot swing it up.
bool OnlyBalances(const std::string& name);

/// Whether a controller has the settings of this section: its own, or those of lqr, which all
/// controllers use.
bool HasSection(const std::string& controller, const std::string& section);

/// Designs a controller. Throws BadInput if the name is unknown or no such controller exists for
/// this plant.
std::shared_ptr<const Policy> MakeController(const std::string& name,
                                             const ControllerConfig& config);

/// Name of the controller with all settings that differ from the defaults: `lqr (lqr_torque 0.1,
/// for mass2 1.2)`. `plant_name` names the file of the plant `named`, from which the design may
/// differ.
std::string TitleOf(const std::string& name, const ControllerConfig& config,
                    const std::string& plant_name = "", const Plant& named = Plant());

}  // namespace upswing
