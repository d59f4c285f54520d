#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "agents/config.h"
#include "base/policy.h"
#include "base/tensors.h"
#include "control/design_plant.h"
#include "pendulum/observation.h"

namespace upswing {

/// A policy and what it needs to be tried out.
struct LoadedPolicy {
  std::string name;  // for messages
  std::string path;  // its file; empty for a controller
  std::shared_ptr<const Policy> policy;
  std::string task;         // kDoublePendulum, or that of an environment of Gymnasium
  Plant plant;              // of the training or of the design, for the double pendulum
  Scale carried_over = {};  // from the plant of its training or design (ForOtherSize)
  // Designs the controller for another plant; empty for a learned policy. Throws BadInput if no
  // such controller exists.
  std::function<std::shared_ptr<const Policy>(const Plant&)> design_for = {};
  std::shared_ptr<const Policy> swing_up = {};  // what the controller hybrid swings up with

  /// Whether it is for an environment that only Python makes and steps.
  bool is_foreign() const { return IsForeign(task); }
  /// Units of its observations, and of the rewards and times of its task.
  Scale scale() const { return ScaleIn(policy->info()); }
  /// Its plant with its control period, as for a design.
  DesignPlant design_plant() const { return {plant, control_period()}; }
  /// Time for which the policy holds a torque, s.
  double control_period() const { return policy->info().control_period.value_or(kControlPeriod); }
  /// Number of past steps in its observations.
  int memory() const;
  /// Whether its observations contain an estimate of the plant.
  bool identifies() const;
  /// Whether its observations contain the pose to reach.
  bool seeks_any_pose() const;
  /// Origin: "training", or "design" for a controller.
  const char* origin() const { return path.empty() ? "design" : "training"; }
};

/// Throws BadInput if the file is a checkpoint.
void ExpectNoCheckpoint(const Tensors& file);

/// The policy in a file. Throws BadInput also for a task that this program lacks: other
/// observations, or a model that a 0.5.0 training had from an MJCF file.
LoadedPolicy ReadPolicy(const Tensors& file);

/// The policy for a plant of another size: it acts there as it acts on its own plant, in the
/// natural units of both (CarryOver), and a controller is designed again. Nothing if the plant has
/// the size of the policy's own, or if the policy is neither a network nor a controller. Throws as
/// design_for does.
std::optional<LoadedPolicy> ForOtherSize(const LoadedPolicy& loaded, const Plant& plant);

/// Throws BadInput unless the policy is for the double pendulum.
void ExpectPendulum(const LoadedPolicy& loaded);

/// Metadata of a policy file on its agent and task.
PolicyInfo InfoOf(const Config& config);

}  // namespace upswing
