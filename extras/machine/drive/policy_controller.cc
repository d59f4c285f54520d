#include "extras/machine/drive/policy_controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/twin/motion.h"
#include "pendulum/observation.h"

namespace upswing::machine {
namespace {

/// Controller made by ControllerOf.
class PolicyController {
 public:
  explicit PolicyController(MachinePolicy policy)
      : policy_(std::move(policy)),
        obs_(static_cast<size_t>(policy_->policy->obs_size())),
        before_(obs_.size()),
        memory_(policy_->policy->Start(1)),
        builder_(1, policy_->scale(), policy_->control_period(), policy_->memory(),
                 policy_->identifies() ? std::optional(policy_->plant) : std::nullopt) {}

  double Torque(int64_t step, const PendulumState& state) {
    const Plant& plant = policy_->plant;
    if (step == 0) {
      builder_.Begin(0, plant, state, obs_);
    } else {
      obs_.swap(before_);
      builder_.Next(0, plant, {state, torque_}, before_, torque_, obs_);
    }
    if (policy_->seeks_any_pose()) WriteGoal(Pose(), policy_->memory(), obs_);  // upright
    policy_->policy->Act({obs_.data(), 1, policy_->policy->obs_size()}, {&torque_, 1, 1}, *memory_);
    torque_ = std::clamp(torque_, -plant.torque_limit, +plant.torque_limit);
    return torque_;
  }

 private:
  MachinePolicy policy_;
  std::vector<float> obs_, before_;
  double torque_ = 0;  // N·m
  std::unique_ptr<Policy::Memory> memory_;
  ObservationBuilder builder_;
};

}  // namespace

const char* NameOf(Robot robot) { return robot == Robot::kPendubot ? "pendubot" : "acrobot"; }

std::optional<Robot> ParseRobot(const std::string& name) {
  for (const Robot robot : {Robot::kPendubot, Robot::kAcrobot}) {
    if (name == NameOf(robot)) return robot;
  }
  if (name.empty()) return std::nullopt;
  throw BadInput(Concat("--robot: expected pendubot or acrobot, got \"", Printable(name), "\""));
}

Plant WithoutDryFriction(Plant plant) {
  plant.coulomb1 = plant.coulomb2 = 0;
  return plant;
}

MachinePolicy GetMachinePolicy(PolicyArguments a, const std::string& robot,
                               const std::optional<Twin>& twin, int64_t hz) {
  const std::optional<Robot> asked = ParseRobot(robot);
  if (twin) {
    a.plant = WithoutDryFriction(twin->plant);
    if (asked) a.plant->actuated_joint = static_cast<int>(*asked);
    if (IsController(a.name) && a.control_period == 0 && hz > 0) {
      const double usual = kControlPeriod * TaskScaleOf(*a.plant).time;
      const double cycles = std::max(1.0, std::round(usual * static_cast<double>(hz)));
      a.control_period = cycles / static_cast<double>(hz);
    }
  }
  const double asked_period = IsController(a.name) ? 0 : std::exchange(a.control_period, 0);
  LoadedPolicy loaded = GetPolicy(a);
  ExpectPendulum(loaded);
  if (twin) loaded = ForOtherSize(loaded, *a.plant).value_or(loaded);
  constexpr double kSamePeriod = 1e-3;  // relative; natural periods have many digits
  const double period = loaded.control_period();
  if (asked_period > 0 && std::abs(asked_period - period) > kSamePeriod * period) {
    throw BadInput(fmt::format(
        "--control-period: expected {:.6g} s, the control period of {}{}, got {}", period,
        Printable(loaded.name), loaded.carried_over == Scale() ? "" : " on this machine",
        FormatNumber(asked_period)));
  }
  auto policy = std::make_shared<const LoadedPolicy>(std::move(loaded));
  const Robot own = RobotOf(*policy);
  if (own == asked.value_or(own)) return policy;
  throw BadInput(Concat("--robot: expected ", NameOf(own), ", the robot of ",
                        Printable(policy->name), " (motor at joint ", static_cast<int>(own),
                        "), got ", NameOf(*asked)));
}

MachinePolicy ForMachine(const LoadedPolicy& loaded, const Twin& twin) {
  ExpectPendulum(loaded);
  const Plant plant = WithoutDryFriction(twin.plant);
  return std::make_shared<const LoadedPolicy>(ForOtherSize(loaded, plant).value_or(loaded));
}

std::string DifferencesFromTwin(const LoadedPolicy& policy, const Twin& twin) {
  constexpr double kSimilar = 0.2;  // relative difference that a policy usually withstands
  const Manipulator own = ManipulatorOf(policy.plant), body = ManipulatorOf(twin.plant);
  std::string text;
  const auto compare = [&](const char* what, double of_policy, double of_twin, const char* unit) {
    if (std::abs(of_policy - of_twin) <= kSimilar * std::abs(of_twin)) return;
    if (!text.empty()) text += ", ";
    text += fmt::format("{} {:.3g}{} (twin {:.3g})", what, of_policy, unit, of_twin);
  };
  // Upright at rest, with straight links: inertia about joint 1 and its moment of gravity.
  compare("inertia", own.Mass(1).M11, body.Mass(1).M11, " kg·m²");
  compare("moment of gravity", own.G1 + own.G2, body.G1 + body.G2, " N·m");
  compare("inertia of link 2", own.J2, body.J2, " kg·m²");
  compare("torque limit", policy.plant.torque_limit, twin.plant.torque_limit, " N·m");
  // Without units: link 2's part of the moment of gravity, and how often the policy decides.
  compare("share of link 2 in it", own.G2 / (own.G1 + own.G2), body.G2 / (body.G1 + body.G2), "");
  const double period = policy.control_period();
  compare("decisions in the natural time", NaturalUnits(policy.plant).time / period,
          NaturalUnits(twin.plant).time / period, "");
  if (text.empty()) return text;
  return fmt::format("{} was made for another plant: {}", Printable(policy.name), text);
}

std::string ChangeOfSize(const LoadedPolicy& policy) {
  const Scale& change = policy.carried_over;
  if (change == Scale()) return {};
  return fmt::format("carried over to a machine of another size: times × {:.4g}, torques × {:.4g}",
                     change.time, change.torque);
}

MachineController ControllerOf(MachinePolicy policy) {
  const double period = policy->control_period();
  const auto law = [controller = std::make_shared<PolicyController>(std::move(policy))](
                       int64_t step, const PendulumState& state) {
    return controller->Torque(step, state);
  };
  return {law, period};
}

}  // namespace upswing::machine
