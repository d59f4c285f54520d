#include "nn/actor_policy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "core/argmax.h"
#include "core/error.h"
#include "core/json.h"
#include "core/text.h"
#include "nn/gaussian.h"

namespace upswing {
namespace {

using nlohmann::json;

constexpr int kBlock = 128;  // rows in one forward pass: the activations stay in the L2 cache
constexpr std::array<std::string_view, 3> kOutputNames{"squashed-gaussian", "clipped-gaussian",
                                                       "categorical"};  // as ActorOutput has them
constexpr const char* kCriticPrefix = "critic.";
// Share of a normal distribution that is more than one standard deviation below its mean.
constexpr double kLowTail = 0.15865525393145707;

/// Buffers of a forward pass of a block of rows.
struct Workspace : Policy::Memory {
  Network<float>::Activations actor, critic;
  AlignedVector<float> outputs;        // (block × outputs)
  AlignedVector<float> critic_inputs;  // (block × (D + A))
  std::vector<double> action;          // (A)
};

int CountOutputs(const ActorParts& parts) {
  if (parts.output == ActorOutput::kCategorical) return static_cast<int>(parts.torques.size());
  return 2 * static_cast<int>(parts.action_limit.size());
}

/// Throws BadInput unless the sizes of the parts fit each other. Networks check their own.
void CheckParts(const ActorParts& parts) {
  const int A = static_cast<int>(parts.action_limit.size());
  const bool categorical = parts.output == ActorOutput::kCategorical;
  if (A < 1 || (categorical ? A != 1 || parts.torques.empty() : !parts.torques.empty())) {
    throw BadInput(Concat("policy: expected limits of at least one action component, and torques ",
                          "if it is categorical, with one component, got ", A, " and ",
                          parts.torques.size(), " torques"));
  }
  const int D = parts.actor.inputs, inputs = parts.critic.inputs;
  if (inputs != 0 && inputs != D && inputs != D + A) {
    throw BadInput(
        Concat("policy: expected a critic of ", D, " or ", D + A, " inputs, got ", inputs));
  }
}

/// The smallest torque up to which these logits (Q) put at least `share` of their probability.
double CategoricalQuantile(std::span<const double> torques, std::span<const float> logits,
                           double share) {
  const double largest = *std::ranges::max_element(logits);
  std::map<double, double> weights;  // e^logit by torque, from the lowest on
  double sum = 0;
  for (size_t i = 0; i < torques.size(); ++i) {
    const double weight = std::exp(logits[i] - largest);
    weights[torques[i]] += weight;
    sum += weight;
  }
  double below = 0;
  for (const auto& [torque, weight] : weights) {
    below += weight;
    if (below >= share * sum) return torque;
  }
  return weights.rbegin()->first;
}

std::string ShapeToJson(const MlpShape& shape) {
  return json{{"inputs", shape.inputs},
              {"hidden", shape.hidden},
              {"layer_norm", shape.layer_norm},
              {"activation", shape.activation == Activation::kTanh ? "tanh" : "relu"}}
      .dump();
}

/// A network's shape from a file's metadata. Throws BadInput.
MlpShape ShapeFromJson(const Tensors& file, const std::string& key) {
  try {
    const json j = ParseJsonObject(file.Metadata(key));
    MlpShape shape;
    shape.inputs = static_cast<int>(JsonInteger(j, "inputs", 1, MlpShape::kMaxWidth));
    for (const json& width : JsonList(j, "hidden", MlpShape::kMaxLayers)) {
      // What is no integer is no width either.
      shape.hidden.push_back(JsonInteger(width).value_or(0));
    }
    shape.layer_norm = JsonBool(j, "layer_norm");
    const json activation = j.value("activation", json());
    if (activation != "relu" && activation != "tanh") {
      throw BadInput("\"activation\": expected \"relu\" or \"tanh\"");
    }
    shape.activation = activation == "tanh" ? Activation::kTanh : Activation::kRelu;
    return shape;
  } catch (const Error& error) {
    throw BadInput(Concat(file.where(), ": metadata \"", key, "\": ", error.what()));
  }
}

/// The network of a file. Throws if it has sizes that none has.
Network<float> NetworkOf(const MlpShape& shape, int outputs, const std::string& where) {
  try {
    return {shape, {outputs}};
  } catch (const Error& error) {
    throw BadInput(Concat(where, ": ", error.what()));
  }
}

/// A vector of a file with 1 to kMaxWidth numbers. Throws BadInput.
std::vector<double> ReadVector(const Tensors& file, const std::string& name) {
  const auto count = static_cast<int64_t>(file.Count<double>(name));
  if (count >= 1 && count <= MlpShape::kMaxWidth) return ReadFinite<double>(file, name, {count});
  throw BadInput(Concat(file.where(), ": tensor \"", name, "\": expected 1 to ",
                        MlpShape::kMaxWidth, " numbers, got ", count));
}

std::string Layers(const MlpShape& shape, int outputs) {
  std::string layers = std::to_string(shape.inputs);
  for (const int64_t width : shape.hidden) layers += Concat('-', width);
  return Concat(layers, '-', outputs);
}

}  // namespace

ActorPolicy::ActorPolicy(ActorParts parts, PolicyInfo info)
    : parts_((CheckParts(parts), std::move(parts))),
      actor_(parts_.actor, {CountOutputs(parts_)}),
      info_(std::move(info)) {
  if (parts_.critic.inputs > 0) {
    critic_ = std::make_unique<const Network<float>>(parts_.critic, HeadShape{1});
  }
  const size_t of_critic = critic_ ? critic_->num_parameters() : 0;
  if (parts_.parameters.size() != actor_.num_parameters() ||
      parts_.critic_parameters.size() != of_critic) {
    throw BadInput(Concat("policy: expected ", actor_.num_parameters(), " parameters and ",
                          of_critic, " of the critic, got ", parts_.parameters.size(), " and ",
                          parts_.critic_parameters.size()));
  }
}

int ActorPolicy::num_outputs() const { return CountOutputs(parts_); }

std::string ActorPolicy::description() const {
  const char* what = parts_.output == ActorOutput::kCategorical
                         ? "likeliest action of a categorical policy "
                         : "mean action of a Gaussian policy ";
  return Concat(what, Layers(parts_.actor, num_outputs()),
                parts_.actor.layer_norm ? ", layer normalisation" : "",
                critic_ ? Concat(", critic ", Layers(parts_.critic, 1)) : "");
}

std::unique_ptr<Policy::Memory> ActorPolicy::Start(int /*num_envs*/) const {
  auto workspace = std::make_unique<Workspace>();
  workspace->actor = actor_.MakeActivations(kBlock, false);
  workspace->outputs.resize(static_cast<size_t>(kBlock) * static_cast<size_t>(num_outputs()));
  workspace->action.resize(parts_.action_limit.size());
  if (!critic_) return workspace;
  workspace->critic = critic_->MakeActivations(kBlock, false);
  workspace->critic_inputs.resize(static_cast<size_t>(kBlock) *
                                  static_cast<size_t>(parts_.critic.inputs));
  return workspace;
}

void ActorPolicy::Outputs(Matrix<const float> obs, Matrix<float> outputs, Memory& memory) const {
  auto& workspace = static_cast<Workspace&>(memory);
  for (int first = 0; first < obs.rows(); first += kBlock) {
    const int rows = std::min(kBlock, obs.rows() - first);
    actor_.Forward({parts_.parameters}, obs.Rows(first, rows), {0, rows}, workspace.actor,
                   outputs.Rows(first, rows));
  }
}

void ActorPolicy::Choose(std::span<const float> outputs, std::span<double> action) const {
  if (parts_.output == ActorOutput::kCategorical) {
    action[0] = parts_.torques[static_cast<size_t>(ArgMax(outputs))];
    return;
  }
  for (size_t k = 0; k < action.size(); ++k) action[k] = Bounded(outputs[k], k);
}

double ActorPolicy::Bounded(double u, size_t k) const {
  const bool squashed = parts_.output == ActorOutput::kSquashedGaussian;
  return parts_.action_limit[k] * (squashed ? std::tanh(u) : std::clamp(u, -1.0, 1.0));
}

void ActorPolicy::Spread(Matrix<const float> obs, Matrix<double> low, Matrix<double> high,
                         Memory& memory) const {
  AlignedVector<float> outputs(static_cast<size_t>(obs.rows()) *
                               static_cast<size_t>(num_outputs()));
  const Matrix<float> rows(outputs, obs.rows(), num_outputs());
  Outputs(obs, rows, memory);
  for (int i = 0; i < obs.rows(); ++i) Spread(rows.row(i), low.row(i), high.row(i));
}

void ActorPolicy::Spread(std::span<const float> outputs, std::span<double> low,
                         std::span<double> high) const {
  if (parts_.output == ActorOutput::kCategorical) {
    low[0] = CategoricalQuantile(parts_.torques, outputs, kLowTail);
    high[0] = CategoricalQuantile(parts_.torques, outputs, 1 - kLowTail);
    return;
  }
  const auto A = parts_.action_limit.size();
  for (size_t k = 0; k < A; ++k) {
    const auto u = Gaussian<double>::From(outputs[k], outputs[A + k]);
    low[k] = Bounded(u.mean - u.std, k);
    high[k] = Bounded(u.mean + u.std, k);
  }
}

void ActorPolicy::Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const {
  auto& workspace = static_cast<Workspace&>(memory);
  for (int first = 0; first < obs.rows(); first += kBlock) {
    const int rows = std::min(kBlock, obs.rows() - first);
    const Matrix<float> outputs(workspace.outputs, rows, num_outputs());
    Outputs(obs.Rows(first, rows), outputs, memory);
    for (int i = 0; i < rows; ++i) Choose(outputs.row(i), action.row(first + i));
  }
}

void ActorPolicy::Values(Matrix<const float> obs, Matrix<float> values, Memory& memory) const {
  auto& workspace = static_cast<Workspace&>(memory);
  const bool takes_action = parts_.critic.inputs > obs_size();
  for (int first = 0; first < obs.rows(); first += kBlock) {
    const int rows = std::min(kBlock, obs.rows() - first);
    Matrix<const float> inputs = obs.Rows(first, rows);
    if (takes_action) {
      const Matrix<float> outputs(workspace.outputs, rows, num_outputs());
      const Matrix<float> joined(workspace.critic_inputs, rows, parts_.critic.inputs);
      Outputs(inputs, outputs, memory);
      for (int i = 0; i < rows; ++i) {
        Choose(outputs.row(i), workspace.action);
        float* row = std::ranges::copy(inputs.row(i), joined.row(i).data()).out;
        for (size_t k = 0; k < workspace.action.size(); ++k) {
          row[k] = static_cast<float>(workspace.action[k] / parts_.action_limit[k]);
        }
      }
      inputs = joined;
    }
    critic_->Forward({parts_.critic_parameters}, inputs, {0, rows}, workspace.critic,
                     values.Rows(first, rows));
  }
}

Tensors ActorPolicy::ToTensors() const {
  const int D = obs_size(), A = action_size();
  const std::vector<float> obs = SampleObservations(D);
  const Matrix<const float> samples(obs.data(), kPolicySamples, D);
  std::vector<float> outputs(static_cast<size_t>(kPolicySamples * num_outputs())),
      values(kPolicySamples);
  std::vector<double> actions(static_cast<size_t>(kPolicySamples * A));
  const std::unique_ptr<Memory> memory = Start(kPolicySamples);
  Outputs(samples, {outputs.data(), kPolicySamples, num_outputs()}, *memory);
  Act(samples, {actions.data(), kPolicySamples, A}, *memory);

  Tensors file = BeginPolicyFile(info_, kOutputNames.at(static_cast<size_t>(parts_.output)));
  file.metadata["network"] = ShapeToJson(parts_.actor);
  AddParameters(file, "", actor_.blocks(), parts_.parameters);
  file.AddCopy<double>("action_limit", parts_.action_limit);
  if (!parts_.torques.empty()) file.AddCopy<double>("torques", parts_.torques);
  file.AddCopy<float>("sample.obs", obs, {kPolicySamples, D});
  file.AddCopy<float>("sample.output", outputs, {kPolicySamples, num_outputs()});
  file.AddCopy<double>("sample.action", actions, {kPolicySamples, A});
  if (!critic_) return file;
  Values(samples, {values.data(), kPolicySamples, 1}, *memory);
  file.metadata["critic"] = ShapeToJson(parts_.critic);
  AddParameters(file, kCriticPrefix, critic_->blocks(), parts_.critic_parameters);
  file.AddCopy<float>("sample.value", values, {kPolicySamples, 1});
  return file;
}

bool ActorPolicy::IsOutput(const std::string& text) {
  return std::ranges::find(kOutputNames, text) != kOutputNames.end();
}

ActorPolicy ActorPolicy::From(const Tensors& file) {
  const std::string& where = file.where();
  const std::string& output = PolicyOutput(file);
  const auto name = std::ranges::find(kOutputNames, output);
  if (name == kOutputNames.end()) {
    throw BadInput(Concat(where, ": output: expected one of ",
                          Join({kOutputNames.begin(), kOutputNames.end()}, ", "), ", got \"",
                          output, "\""));
  }
  ActorParts parts;
  parts.output = static_cast<ActorOutput>(name - kOutputNames.begin());
  parts.action_limit = ReadVector(file, "action_limit");
  if (parts.output == ActorOutput::kCategorical) parts.torques = ReadVector(file, "torques");
  const auto limited = [](double limit) { return limit > 0; };
  if (!std::ranges::all_of(parts.action_limit, limited)) {
    throw BadInput(Concat(where, ": tensor \"action_limit\": expected numbers above 0"));
  }
  parts.actor = ShapeFromJson(file, "network");
  const Network<float> actor = NetworkOf(parts.actor, CountOutputs(parts), where);
  ExpectParameters(file, "", actor.blocks());
  if (file.metadata.contains("critic")) {
    parts.critic = ShapeFromJson(file, "critic");
    const Network<float> critic = NetworkOf(parts.critic, 1, where);
    ExpectParameters(file, kCriticPrefix, critic.blocks());
    parts.critic_parameters = ReadParameters(file, kCriticPrefix, critic.blocks());
  }
  parts.parameters = ReadParameters(file, "", actor.blocks());
  try {
    ActorPolicy policy(std::move(parts), ParsePolicyInfo(file.metadata, where));
    policy.CheckFile(file);
    return policy;
  } catch (const Error& error) {
    const std::string message = error.what();
    throw BadInput(message.starts_with(where) ? message : Concat(where, ": ", message));
  }
}

void ActorPolicy::CheckFile(const Tensors& file) {
  const int D = obs_size(), A = action_size();
  const int samples = CountSamples(file, "sample.action", A);
  const std::vector<float> obs = ReadFinite<float>(file, "sample.obs", {samples, D});
  const std::vector<double> stored = ReadFinite<double>(file, "sample.action", {samples, A});
  const Matrix<const float> rows(obs.data(), samples, D);
  const std::unique_ptr<Memory> memory = Start(samples);
  const auto count = static_cast<size_t>(samples);

  std::vector<float> outputs(count * static_cast<size_t>(num_outputs())), values(count);
  std::vector<double> actions(stored.size());
  Outputs(rows, {outputs.data(), samples, num_outputs()}, *memory);
  Act(rows, {actions.data(), samples, A}, *memory);
  const Matrix<const float> output_rows(outputs.data(), samples, num_outputs());
  CheckSamples(file, "sample.output", output_rows, "output", self_check_);
  for (size_t i = 0; i < stored.size(); ++i) {
    const double limit = parts_.action_limit[i % parts_.action_limit.size()];
    // Logits that are nearly equal may choose another torque on another machine.
    const bool categorical = parts_.output == ActorOutput::kCategorical;
    const bool right =
        categorical
            ? MayChoose(parts_.torques, stored[i], output_rows.row(static_cast<int>(i)),
                        2 * self_check_.tolerance)
            : std::abs(stored[i] - actions[i]) <= limit * std::max(self_check_.tolerance, 1e-9);
    if (right) continue;
    throw BadInput(Concat(file.where(), ": self-check: expected action ", stored[i], ", got ",
                          actions[i], " (sample ", i / static_cast<size_t>(A), ")"));
  }
  if (!critic_) return;
  Values(rows, {values.data(), samples, 1}, *memory);
  CheckSamples(file, "sample.value", {values.data(), samples, 1}, "value", self_check_);
}

}  // namespace upswing
