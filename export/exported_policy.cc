#include "export/exported_policy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "core/error.h"
#include "core/text.h"
#include "nn/actor_policy.h"
#include "nn/q_policy.h"
#include "sim/acrobot_v1.h"
#include "sim/pendulum_v1.h"

namespace upswing {
namespace {

/// A layer of a policy's file.
PlainLayer ReadLayer(const Tensors& file, const std::string& prefix, const std::string& name,
                     int in, int out, Activation activation = Activation::kNone,
                     bool layer_norm = false) {
  PlainLayer layer{prefix + name, in, out, {}, {}, {}, {}, activation};
  const auto units = static_cast<size_t>(out);
  const auto read = [&](const char* what, std::vector<float>& values, size_t size) {
    values.resize(size);
    file.Read(layer.name + what, std::span(values));
  };
  read(".weight", layer.weight, units * static_cast<size_t>(in));
  read(".bias", layer.bias, units);
  if (!layer_norm) return layer;
  read(".norm.weight", layer.gain, units);
  read(".norm.bias", layer.norm_bias, units);
  return layer;
}

std::vector<PlainLayer> ReadFeatures(const Tensors& file, const std::string& prefix,
                                     const MlpShape& shape) {
  std::vector<PlainLayer> layers;
  int in = shape.inputs;
  for (size_t i = 0; i < shape.hidden.size(); ++i) {
    const int out = static_cast<int>(shape.hidden[i]);
    layers.push_back(ReadLayer(file, prefix, Concat("feature.", i), in, out, shape.activation,
                               shape.layer_norm));
    in = out;
  }
  return layers;
}

/// Half of the rows of a layer: the first or the second.
PlainLayer Half(const PlainLayer& whole, bool second, const std::string& name) {
  PlainLayer half{name, whole.in, whole.out / 2, {}, {}, {}, {}, whole.activation};
  const auto cut = [&](const std::vector<float>& values) {
    const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
    return second ? std::vector<float>(middle, values.end())
                  : std::vector<float>(values.begin(), middle);
  };
  half.weight = cut(whole.weight);
  half.bias = cut(whole.bias);
  return half;
}

PlainNetwork NetworkOf(const Tensors& file, const QNetworkShape& shape) {
  PlainNetwork network;
  network.features = ReadFeatures(file, "", {shape.inputs, shape.hidden, shape.layer_norm});
  const int width = network.features.back().out;
  if (!shape.dueling) {
    network.outputs = {ReadLayer(file, "", "output", width, shape.actions)};
    return network;
  }
  const int head = static_cast<int>(shape.head);
  const PlainLayer streams = ReadLayer(file, "", "streams", width, 2 * head, Activation::kRelu);
  network.value = {Half(streams, false, "streams.value"), ReadLayer(file, "", "value", head, 1)};
  network.outputs = {Half(streams, true, "streams.advantage"),
                     ReadLayer(file, "", "advantage", head, shape.actions)};
  return network;
}

PlainNetwork NetworkOf(const Tensors& file, const std::string& prefix, const MlpShape& shape,
                       int outputs) {
  PlainNetwork network;
  network.features = ReadFeatures(file, prefix, shape);
  network.outputs = {ReadLayer(file, prefix, "output", network.features.back().out, outputs)};
  return network;
}

/// Throws BadInput unless these torques can be told as float.
void CheckTorques(std::span<const double> torques, const std::string& where) {
  for (const double torque : torques) {
    if (std::abs(torque) <= std::numeric_limits<float>::max()) continue;
    throw BadInput(Concat(where, ": expected torques within the range of float, got ", torque));
  }
}

/// The observation of the double pendulum (Observe of sim/double_pendulum.h).
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

std::vector<NamedInput> InputsOf(const LoadedPolicy& loaded) {
  if (HasPlant(loaded.task)) return PendulumInputs(loaded.memory());
  if (loaded.task == kPendulumV1) {
    return {{"cos theta", "cosine of the angle, 0 upright"},
            {"sin theta", "its sine"},
            {"omega", "velocity of theta, rad/s"}};
  }
  if (loaded.task == kAcrobotV1) {
    return {{"cos theta1", "cosine of the angle of link 1, 0 hanging"},
            {"sin theta1", "its sine"},
            {"cos theta2", "cosine of the angle of link 2 relative to link 1"},
            {"sin theta2", "its sine"},
            {"omega1", "velocity of theta1, rad/s"},
            {"omega2", "velocity of theta2, rad/s"}};
  }
  throw UnknownObservations(loaded);
}

PolicyOutputKind KindOf(ActorOutput output) {
  switch (output) {
    case ActorOutput::kSquashedGaussian:
      return PolicyOutputKind::kSquashedGaussian;
    case ActorOutput::kClippedGaussian:
      return PolicyOutputKind::kClippedGaussian;
    default:
      return PolicyOutputKind::kCategorical;
  }
}

}  // namespace

double LargestSize(std::span<const double> values) {
  double largest = 0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  return largest;
}

Error UnknownObservations(const LoadedPolicy& loaded) {
  return BadInput(Concat(loaded.path, ": the observations of the task ", loaded.task,
                         " are not known to export"));
}

bool ExportedPolicy::critic_takes_action() const {
  return has_critic() && critic.features.front().in > obs_size();
}

ExportedPolicy TakeApart(const LoadedPolicy& loaded) {
  if (loaded.identifies()) {
    throw BadInput(Concat(loaded.path,
                          ": expected a policy that needs no identification of the plant: export "
                          "does not hold its estimator"));
  }
  EnvConfig env;
  env.task = loaded.task;
  const std::string where = loaded.path;
  ExportedPolicy exported;
  exported.loaded = &loaded;
  exported.spec = SpecOf(env);
  exported.observation = InputsOf(loaded);
  if (const auto* q = dynamic_cast<const QPolicy*>(loaded.policy.get())) {
    const std::span<const double> torques = q->value_actions().values();
    CheckTorques(torques, where);
    exported.torques.assign(torques.begin(), torques.end());
    exported.limit = LargestSize(exported.torques);
    exported.network = NetworkOf(q->ToTensors(), q->shape());
    return exported;
  }
  const auto* actor = dynamic_cast<const ActorPolicy*>(loaded.policy.get());
  if (actor == nullptr || actor->action_size() != 1) {
    throw BadInput(Concat(where, ": expected a learned policy of one motor, got ",
                          loaded.policy->description()));
  }
  const ActorParts& parts = actor->parts();
  const Tensors file = actor->ToTensors();
  exported.kind = KindOf(parts.output);
  CheckTorques(parts.torques, where);
  CheckTorques(parts.action_limit, where);
  exported.torques = parts.torques;
  exported.action_limit = parts.action_limit[0];
  exported.limit = exported.is_discrete() ? LargestSize(exported.torques) : exported.action_limit;
  exported.network = NetworkOf(file, "", parts.actor, actor->num_outputs());
  if (parts.critic.inputs > 0) exported.critic = NetworkOf(file, "critic.", parts.critic, 1);
  return exported;
}

}  // namespace upswing
