#include "extras/deploy/exported_policy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "base/error.h"
#include "base/text.h"
#include "extras/deploy/c_header.h"
#include "pendulum/observation.h"

namespace upswing::deploy {
namespace {

/// The meanings of the inputs that identification adds, in the order of their names in
/// ObservationInfo::identified.
std::vector<std::string> IdentifiedMeanings() {
  const auto constant = [](const char* what) {
    return Concat("identified ", what, ", share above nominal over ", kConstantScale);
  };
  return {constant("inertia about joint 1, link 2 as a point"),
          constant("inertia of link 2 about joint 2"),
          constant("coupling: mass 2, length 1, centre 2"),
          constant("gravity about joint 1, link 2 as a point"),
          constant("gravity on link 2 about joint 2"),
          constant("damping of joint 1"),
          constant("damping of joint 2"),
          "distance of the identified plant from plants that the motor cannot hold",
          "steep near 0, where the motor cannot hold the plant",
          "energy of the identified plant: 0 hanging at rest, 1 upright",
          "z / (1 + size of z) of the faster fall, which the motor can stop for z within +-1",
          "z / (1 + size of z) of the slower fall",
          "that stops both falls, over the motor's limit, within +-1"};
}

/// The inputs of the double pendulum's observation (ObservationBuilder of pendulum/observation.h).
std::vector<NamedInput> PendulumInputs(const LoadedPolicy& loaded) {
  const Scale scale = loaded.scale();
  const ObservationInfo& observation = *loaded.policy->info().observation;
  const auto over = [](double scale, const char* unit) {
    return Concat(" over ", FormatNumber(scale), ' ', unit);
  };
  std::vector<NamedInput> inputs{
      {"cos q1", "cosine of the angle of link 1, 0 hanging"},
      {"sin q1", "its sine"},
      {"w1", "velocity of q1" + over(kMaxVelocity1 * scale.velocity(), "rad/s")},
      {"cos q2", "cosine of the angle of link 2 relative to link 1"},
      {"sin q2", "its sine"},
      {"w2", "velocity of q2" + over(kMaxVelocity2 * scale.velocity(), "rad/s")},
      {"energy", "mechanical energy: 0 hanging at rest, 1 upright at rest"},
      {"height", "height of the tip over the pivot, over the length of both links"}};
  if (observation.identified) {
    const std::vector<std::string> meanings = IdentifiedMeanings();
    for (size_t i = 0; i < meanings.size(); ++i) {
      inputs.push_back({observation.identified->names[i], meanings[i]});
    }
  }
  for (const std::string& goal : observation.goal) {
    inputs.push_back({goal, "1 if the link is to point up, -1 if down"});
  }
  for (int step = 1; step <= loaded.memory(); ++step) {
    const std::string past = Concat(step, step == 1 ? " step ago" : " steps ago");
    inputs.push_back(
        {"change of w1, " + past,
         "what w1 changed by in that step" + over(kMemoryVelocity * scale.velocity(), "rad/s")});
    inputs.push_back(
        {"change of w2, " + past,
         "what w2 changed by in that step" + over(kMemoryVelocity * scale.velocity(), "rad/s")});
    inputs.push_back({"torque, " + past, "the torque chosen for that step" +
                                             over(kMemoryTorque * scale.torque, "N m")});
  }
  return inputs;
}

/// The description of a foreign task, whose observation only its environment explains. The
/// observation stands for the state.
ExportedTask ForeignTaskOf(const LoadedPolicy& loaded) {
  ExportedTask task{"foreign.c", "acts in " + loaded.task, "", {}, {}};
  for (int i = 0; i < loaded.policy->obs_size(); ++i) {
    task.observation.push_back({Concat("observation ", i), "as the environment gives it"});
  }
  return task;
}

}  // namespace

double LargestSize(std::span<const double> values) {
  double largest = 0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  return largest;
}

ExportedTask PendulumTask(const LoadedPolicy& loaded) {
  return {loaded.identifies() ? "adaptive.c" : "pendulum.c",
          loaded.seeks_any_pose()
              ? "brings a double pendulum with one motor to any of its poses of rest"
              : "swings up and balances a double pendulum with one motor",
          Concat("at joint ", loaded.plant.actuated_joint),
          {{"q1", "rad    angle of link 1, 0 hanging"},
           {"q2", "rad    angle of link 2 relative to link 1, 0 in line with it"},
           {"w1", "rad/s  velocity of q1"},
           {"w2", "rad/s  velocity of q2"}},
          PendulumInputs(loaded)};
}

std::vector<LayerView> ExportedPolicy::ActingLayers() const {
  std::vector<LayerView> acting = layers;
  if (policy->parts().shape.dueling()) acting.erase(acting.end() - 4, acting.end() - 2);
  return acting;
}

ExportedPolicy ViewForExport(const LoadedPolicy& loaded) {
  const std::string where = loaded.path;
  ExportedPolicy exported;
  exported.loaded = &loaded;
  exported.task = loaded.is_foreign() ? ForeignTaskOf(loaded) : PendulumTask(loaded);
  exported.policy = dynamic_cast<const NetworkPolicy*>(loaded.policy.get());
  if (exported.policy == nullptr) {
    throw BadInput(Concat(loaded.name, ": expected a learned policy, got ",
                          loaded.policy->description(), "; --c exports ",
                          Join(ControllersInC(), ", ")));
  }
  const NetworkPolicyParts& parts = exported.policy->parts();
  exported.limit = LargestSize(exported.is_discrete() ? parts.torques : parts.action_limit);
  for (const double size : {exported.limit, LargestSize(parts.action_limit)}) {
    if (size <= std::numeric_limits<float>::max()) continue;
    throw BadInput(Concat(where, ": expected torques within the range of float, got ", size));
  }
  exported.layers = exported.policy->Layers();
  exported.critic = exported.policy->CriticLayers();
  for (LayerView& layer : exported.critic) layer.name = "critic." + layer.name;
  return exported;
}

}  // namespace upswing::deploy
