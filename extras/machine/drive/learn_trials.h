#pragma once

#include <functional>

#include "extras/machine/drive/learning_run.h"
#include "extras/machine/drive/policy_controller.h"
#include "extras/machine/twin/twin.h"

/// Tries of controllers, on the machine and on simulated ones.
namespace upswing::machine {

/// Number of simulated machines that judge a controller.
inline constexpr int kDraws = 5;

/// The rules of a try on a machine like this twin, with a share of dry friction that the motors
/// compensate.
RunRules TryRules(const LearnConfig& config, const Twin& twin, double compensation);

/// Simulated machines like a twin.
struct Draws {
  Twin twin;
  double spread = 1;        // standard deviations of the machines, in those of the twin
  PendulumState rest = {};  // in which tries begin
};

/// Number of machines, of kDraws, that a controller balances within 95% of the limits.
/// `stop` asks for an end.
int HeldBy(const LearnConfig& config, const Draws& draws, const MachinePolicy& policy,
           double compensation, const std::function<bool()>& stop);

/// Whether a value of the twin differs from that of an earlier one by more than two standard
/// deviations of the earlier one.
bool HasChanged(const Twin& before, const Twin& now);

}  // namespace upswing::machine
