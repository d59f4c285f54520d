#pragma once

#include <memory>
#include <optional>
#include <string>

#include "agents/loaded_policy.h"
#include "extras/machine/drive/machine_controller.h"
#include "extras/machine/twin/twin.h"
#include "runs/find_policy.h"

/// Policies of the double pendulum as controllers of a machine.
namespace upswing::machine {

/// The robot: the joint with the motor.
enum class Robot { kPendubot = 1, kAcrobot = 2 };
const char* NameOf(Robot robot);
/// The robot with this name; nothing for "". Throws BadInput.
std::optional<Robot> ParseRobot(const std::string& name);
/// Index of the motor's joint.
inline size_t MotorOf(Robot robot) { return static_cast<size_t>(robot) - 1; }

/// A policy of the double pendulum, for the plant of its design.
using MachinePolicy = std::shared_ptr<const LoadedPolicy>;
inline Robot RobotOf(const LoadedPolicy& policy) {
  return static_cast<Robot>(static_cast<int>(policy.plant.actuated_joint));
}

/// The plant for which controllers are designed: motors compensate most of the dry friction, and a
/// linear model has none.
Plant WithoutDryFriction(Plant plant);

/// The policy that the arguments name, for this robot ("": the policy's own, a controller's that of
/// the twin), in a loop with `hz` cycles per second. With `twin`, a controller is designed for its
/// plant without dry friction, and for a whole number of cycles unless `hz` is 0; a policy of
/// another size is carried over (ForOtherSize). Throws BadInput.
MachinePolicy GetMachinePolicy(PolicyArguments a, const std::string& robot,
                               const std::optional<Twin>& twin, int64_t hz);
/// A loaded policy for a machine: carried over if the twin has another size. Throws BadInput.
MachinePolicy ForMachine(const LoadedPolicy& loaded, const Twin& twin);

/// How the plant that a policy was made for differs from the twin, in a line: times and torques
/// that decide how the machine answers. Empty if they hardly differ.
std::string DifferencesFromTwin(const LoadedPolicy& policy, const Twin& twin);
/// How a policy was carried over to a machine of another size, in a line; empty if it was not.
std::string ChangeOfSize(const LoadedPolicy& policy);

/// A policy as the controller of one machine. It acts once in its control period, on PendulumEnv's
/// observations of the policy's design plant.
MachineController ControllerOf(MachinePolicy policy);

}  // namespace upswing::machine
