#include "extras/deploy/exported_policy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "base/error.h"
#include "base/text.h"
#include "pendulum/acrobot_v1.h"
#include "pendulum/pendulum_v1.h"

namespace upswing {
namespace {

/// Throws BadInput unless these torques are within the range of float.
void CheckTorques(std::span<const double> torques, const std::string& where) {
  for (const double torque : torques) {
    if (std::abs(torque) <= std::numeric_limits<float>::max()) continue;
    throw BadInput(Concat(where, ": expected torques within the range of float, got ", torque));
  }
}

/// The inputs of the double pendulum's observation (Observe of pendulum/double_pendulum.h).
std::vector<NamedInput> PendulumInputs(int memory) {
  const auto over = [](double scale, const char* unit) {
    return Concat(" over ", FormatNumber(scale), ' ', unit);
  };
  std::vector<NamedInput> inputs{
      {"cos q1", "cosine of the angle of link 1, 0 hanging"},
      {"sin q1", "its sine"},
      {"w1", "velocity of q1" + over(kMaxVelocity1, "rad/s")},
      {"cos q2", "cosine of the angle of link 2 relative to link 1"},
      {"sin q2", "its sine"},
      {"w2", "velocity of q2" + over(kMaxVelocity2, "rad/s")},
      {"energy", "mechanical energy: 0 hanging at rest, 1 upright at rest"},
      {"height", "height of the tip over the pivot, over the length of both links"}};
  for (int step = 1; step <= memory; ++step) {
    const std::string past = Concat(step, step == 1 ? " step ago" : " steps ago");
    inputs.push_back({"change of w1, " + past,
                      "what w1 changed by in that step" + over(kMemoryVelocity, "rad/s")});
    inputs.push_back({"change of w2, " + past,
                      "what w2 changed by in that step" + over(kMemoryVelocity, "rad/s")});
    inputs.push_back(
        {"torque, " + past, "the torque chosen for that step" + over(kMemoryTorque, "N m")});
  }
  return inputs;
}

/// The description of a foreign task, whose observation only its environment explains. The
/// observation stands for the state.
ExportedTask ForeignTaskOf(const LoadedPolicy& loaded) {
  ExportedTask task{loaded.task, "foreign.c", "acts in " + loaded.task, "", {}, {}};
  for (int i = 0; i < loaded.policy->obs_size(); ++i) {
    task.observation.push_back({Concat("observation ", i), "as the environment gives it"});
  }
  return task;
}

/// The description of the policy's task. Throws BadInput for a task without a description here.
ExportedTask TaskOf(const LoadedPolicy& loaded) {
  if (IsForeign(loaded.task)) return ForeignTaskOf(loaded);
  for (const ExportedTask& task :
       {PendulumTask(loaded.plant.actuated_joint, loaded.memory()),
        ExportedTask{kPendulumV1,
                     "pendulum_v1.c",
                     "swings up and balances a pendulum (Gymnasium's Pendulum-v1)",
                     "at the joint",
                     {{"theta", "rad    angle, 0 upright"}, {"omega", "rad/s  its velocity"}},
                     {{"cos theta", "cosine of the angle, 0 upright"},
                      {"sin theta", "its sine"},
                      {"omega", "velocity of theta, rad/s"}}},
        ExportedTask{kAcrobotV1,
                     "acrobot_v1.c",
                     "swings the end of a double pendulum up (Gymnasium's Acrobot-v1)",
                     "at the joint between the links",
                     {{"theta1", "rad    angle of link 1, 0 hanging"},
                      {"theta2", "rad    angle of link 2 relative to link 1, 0 in line with it"},
                      {"omega1", "rad/s  velocity of theta1"},
                      {"omega2", "rad/s  velocity of theta2"}},
                     {{"cos theta1", "cosine of the angle of link 1, 0 hanging"},
                      {"sin theta1", "its sine"},
                      {"cos theta2", "cosine of the angle of link 2 relative to link 1"},
                      {"sin theta2", "its sine"},
                      {"omega1", "velocity of theta1, rad/s"},
                      {"omega2", "velocity of theta2, rad/s"}}}}) {
    if (task.name == loaded.task) return task;
  }
  throw BadInput(Concat(loaded.path, ": expected a task that can be exported, got ", loaded.task));
}

}  // namespace

double LargestSize(std::span<const double> values) {
  double largest = 0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  return largest;
}

ExportedTask PendulumTask(double actuated_joint, int memory) {
  return {kDoublePendulum,
          "pendulum.c",
          "swings up and balances a double pendulum with one motor",
          Concat("at joint ", actuated_joint),
          {{"q1", "rad    angle of link 1, 0 hanging"},
           {"q2", "rad    angle of link 2 relative to link 1, 0 in line with it"},
           {"w1", "rad/s  velocity of q1"},
           {"w2", "rad/s  velocity of q2"}},
          PendulumInputs(memory)};
}

std::vector<LayerView> ExportedPolicy::ActingLayers() const {
  std::vector<LayerView> acting = layers;
  if (policy->parts().shape.dueling()) acting.erase(acting.end() - 4, acting.end() - 2);
  return acting;
}

ExportedPolicy ViewForExport(const LoadedPolicy& loaded) {
  if (loaded.identifies()) {
    throw BadInput(Concat(loaded.path,
                          ": expected a policy without identification of the plant, which exports "
                          "do not contain, got one with it"));
  }
  const std::string where = loaded.path;
  ExportedPolicy exported;
  exported.loaded = &loaded;
  exported.task = TaskOf(loaded);
  exported.policy = dynamic_cast<const NetworkPolicy*>(loaded.policy.get());
  if (exported.policy == nullptr) {
    throw BadInput(
        Concat(where, ": expected a learned policy, got ", loaded.policy->description()));
  }
  const NetworkPolicyParts& parts = exported.policy->parts();
  if (IsForeign(loaded.task)) {
    exported.spec.task = loaded.task;
    exported.spec.action_unit = "";
    exported.spec.state_names = NamesOf(exported.task.observation);
    exported.spec.step_seconds = *loaded.policy->info().control_period;
  } else {
    EnvConfig env;
    env.task = loaded.task;
    exported.spec = SpecOf(env);
  }
  CheckTorques(parts.torques, where);
  CheckTorques(parts.action_limit, where);
  exported.limit = LargestSize(exported.is_discrete() ? parts.torques : parts.action_limit);
  exported.layers = exported.policy->Layers();
  exported.critic = exported.policy->CriticLayers();
  for (LayerView& layer : exported.critic) layer.name = "critic." + layer.name;
  return exported;
}

}  // namespace upswing
