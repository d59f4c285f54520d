#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/policy.h"
#include "control/design_plant.h"
#include "control/settings.h"

/// Controllers that are designed from the equations of motion. Commands that take a policy file
/// also take the name of a controller.
namespace upswing {

/// Settings of all controllers.
struct ControllerConfig {
  DesignPlant plant;
  LqrConfig lqr;
  SwingUpConfig tvlqr;
  MpcConfig mpc;
  EnergyShapingConfig energy;
  PartialFeedbackConfig pfl;
  std::string swing_up;                           // for `hybrid`: name of the policy that swings up
  std::shared_ptr<const Policy> swing_up_policy;  // the loaded swing_up policy; not a setting

  /// The default settings for a plant: those of the built-in plant, in natural units.
  static ControllerConfig For(const DesignPlant& plant);
  /// These settings in natural units that are `ratio` times as large. Keeps the plant, but not its
  /// control period.
  ControllerConfig In(const Scale& ratio) const;

  /// Describes all settings except the plant, which has its own flags.
  void Describe(Options& options);
};

/// A kind of controller. Commands, help texts, Python and the page read these from one table, in
/// controllers.cc.
struct ControllerKind {
  const char* name;
  const char* help;  // what it does, with the controller as the subject: "follows a plan"
  std::shared_ptr<const Policy> (*make)(const ControllerConfig& config);
  bool only_balances = false;  // holds the pendulum upright and cannot swing it up
};

/// All kinds, in alphabetical order.
std::span<const ControllerKind> ControllerKinds();

/// The kind of this name; null if there is none.
const ControllerKind* FindController(const std::string& name);

/// Names of the controllers, in alphabetical order.
std::vector<std::string> ControllerNames();

bool IsController(const std::string& name);

/// Whether a controller only holds the pendulum upright and cannot swing it up.
bool OnlyBalances(const std::string& name);

/// Whether a controller has the settings of this section: the section of its own name, or that of
/// lqr, which all controllers use.
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
