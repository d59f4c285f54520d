// Files of network policies (docs/reference/policy-format.md): the format, the parameters, and
// sample inputs and outputs that every load recomputes.
#include <algorithm>
#include <cmath>

#include "base/argmax.h"
#include "base/error.h"
#include "base/finite.h"
#include "base/json.h"
#include "base/rng.h"
#include "base/text.h"
#include "nn/linear.h"
#include "nn/network_policy.h"

namespace upswing {
namespace {

using nlohmann::json;

constexpr std::string_view kFormat = "upswing-policy";
constexpr std::string_view kFormatVersion = "1";
constexpr const char* kCriticPrefix = "critic.";
constexpr int kSamples = 16;      // number of stored samples
constexpr int kMostSamples = 64;  // limit for files of other programs

// Largest difference between two machines, which sum in different orders, as a share of the largest
// output. The vector paths (AVX-512, AVX2, portable) differ from each other by at most 3e-7 for the
// networks that come with the page. They differ by at most 1.1e-6 for random networks of up to 16
// layers or 4096 units. Single and double precision differ by 4e-7 and 2.3e-6.
constexpr double kTolerance = 1e-5;

// ---- Shapes.

/// The shape as metadata text.
std::string ShapeToJson(const NetworkShape& shape, const ActionRuleFacts& rule) {
  json j{{"inputs", shape.inputs}, {"hidden", shape.hidden}, {"layer_norm", shape.layer_norm}};
  if (rule.is_actor()) {
    j["activation"] = shape.activation == Activation::kTanh ? "tanh" : "relu";
  } else {
    j["actions"] = shape.outputs;
    j["dueling"] = shape.dueling();
    j["head"] = shape.streams;
  }
  return j.dump();
}

/// Reads a shape from a file's metadata. For Q-values, the file gives the number of outputs;
/// otherwise `outputs` does. Throws BadInput.
NetworkShape ShapeFromJson(const Tensors& file, const std::string& key, const ActionRuleFacts& rule,
                           int outputs) {
  constexpr int64_t kMax = NetworkShape::kMaxWidth;
  const std::string& text = file.Metadata(key);
  try {
    const json j = ParseJsonObject(text);
    NetworkShape shape;
    shape.inputs = static_cast<int>(JsonInteger(j, "inputs", 1, kMax));
    shape.outputs = outputs;
    for (const json& width : JsonList(j, "hidden", NetworkShape::kMaxLayers)) {
      // A width that is not an integer becomes the invalid width 0.
      shape.hidden.push_back(JsonInteger(width).value_or(0));
    }
    shape.layer_norm = JsonBool(j, "layer_norm");
    if (!rule.is_actor()) {
      shape.outputs = static_cast<int>(JsonInteger(j, "actions", 1, kMax));
      shape.streams = JsonInteger(j, "head", 0, kMax);
      if (JsonBool(j, "dueling") == shape.dueling()) return shape;
      throw BadInput(
          Concat("\"head\": expected at least 1 if \"dueling\", else 0, got ", shape.streams));
    }
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

// ---- Tensors.

/// Reads a tensor of this shape and checks that its numbers are finite. Throws BadInput.
template <typename T>
std::vector<T> ReadFinite(const Tensors& file, const std::string& name,
                          const std::vector<int64_t>& shape) {
  file.Expect(name, kDtypeOf<T>, shape);
  std::vector<T> values(file.Count<T>(name));
  file.Read(name, std::span(values));
  const std::string problem = FindNotFinite<T>(values);
  if (problem.empty()) return values;
  throw BadInput(Concat(file.where(), ": tensor \"", name, "\": ", problem));
}

/// Reads a vector of 1 to kMaxWidth numbers. Throws BadInput.
std::vector<double> ReadVector(const Tensors& file, const std::string& name) {
  const auto count = static_cast<int64_t>(file.Count<double>(name));
  if (count >= 1 && count <= NetworkShape::kMaxWidth) {
    return ReadFinite<double>(file, name, {count});
  }
  throw BadInput(Concat(file.where(), ": tensor \"", name, "\": expected 1 to ",
                        NetworkShape::kMaxWidth, " numbers, got ", count));
}

/// The shape of a parameter array in a file. Weights are (out × in), as in torch.nn.Linear.
std::vector<int64_t> FileShape(const ParameterBlock& block) {
  if (block.in == 0) return {block.out};
  return {block.out, block.in};
}

/// Adds the parameter arrays with names that begin with `prefix`. Throws Failure if a number is not
/// finite.
void AddParameters(Tensors& file, const std::string& prefix, const Network& network,
                   std::span<const float> parameters) {
  const std::string problem = FindNotFinite<float>(parameters);
  if (!problem.empty()) throw Failure(Concat("policy parameters: ", problem));
  std::vector<float> array;
  for (const ParameterBlock& block : network.blocks()) {
    const Matrix<const float> values(parameters.data() + block.offset, std::max(1, block.in),
                                     block.out);
    array.resize(block.size());
    Transpose(values, Matrix<float>(array, values.cols(), values.rows()));
    file.AddCopy<float>(prefix + block.name, array, FileShape(block));
  }
}

/// Throws BadInput unless the file has the network's parameter arrays. Call it for all networks of
/// a policy before you allocate memory for one, so that a false size takes no memory.
void ExpectParameters(const Tensors& file, const std::string& prefix, const Network& network) {
  for (const ParameterBlock& block : network.blocks()) {
    file.Expect(prefix + block.name, Dtype::kF32, FileShape(block));
  }
}

/// Reads the parameters that AddParameters wrote. Throws BadInput.
AlignedVector<float> ReadParameters(const Tensors& file, const std::string& prefix,
                                    const Network& network) {
  AlignedVector<float> parameters(network.num_parameters());
  for (const ParameterBlock& block : network.blocks()) {
    const std::vector<float> array = ReadFinite<float>(file, prefix + block.name, FileShape(block));
    const Matrix<float> values(parameters.data() + block.offset, std::max(1, block.in), block.out);
    Transpose(Matrix<const float>(array, values.cols(), values.rows()), values);
  }
  return parameters;
}

// ---- Samples.

/// Names of the sample tensors in a file.
struct SampleNames {
  std::string output, action;
};
SampleNames NamesFor(const ActionRuleFacts& rule) {
  if (rule.is_actor()) return {"sample.output", "sample.action"};
  return {"sample.q", "sample.torque"};
}

/// The shape of the sample actions in a file.
std::vector<int64_t> ActionShape(const NetworkPolicyParts& parts, int samples) {
  if (parts.facts().is_actor()) return {samples, parts.action_size()};
  return {samples};
}

/// Results of a policy for n samples: outputs (n × O), actions (n × A) and, for an actor with a
/// critic, V (n).
struct SampleResults {
  std::vector<float> outputs, values;
  std::vector<double> actions;
  Matrix<const float> output_rows, value_rows;

  SampleResults(const NetworkPolicy& policy, Matrix<const float> obs)
      : outputs(obs.rows() * policy.num_outputs()),
        values(policy.is_actor() && policy.num_values() > 0 ? obs.rows() : 0),
        actions(obs.rows() * policy.action_size()),
        output_rows(outputs.data(), obs.rows(), policy.num_outputs()),
        value_rows(values.data(), static_cast<int>(values.size()), 1) {
    const auto memory = policy.Start(obs.rows());
    const Matrix<double> action_rows(actions, obs.rows(), policy.action_size());
    policy.Outputs(obs, {outputs.data(), obs.rows(), policy.num_outputs()}, *memory);
    for (int i = 0; i < obs.rows(); ++i) policy.Choose(output_rows.row(i), action_rows.row(i));
    if (!values.empty()) policy.Values(obs, {values.data(), obs.rows(), 1}, *memory);
  }
};

/// Throws BadInput unless the recomputed outputs (rows × cols) equal the tensor `name` up to
/// rounding. `what` names the outputs in messages. Updates `check`.
void CheckOutputs(const Tensors& file, const std::string& name, Matrix<const float> computed,
                  std::string_view what, SelfCheck& check) {
  const std::vector<float> expected =
      ReadFinite<float>(file, name, {computed.rows(), computed.cols()});
  double largest = 0;
  for (const float x : expected) largest = std::max(largest, std::abs(double{x}));
  const double tolerance = kTolerance * largest;
  check.tolerance = std::max(check.tolerance, tolerance);
  for (size_t i = 0; i < expected.size(); ++i) {
    const float got = computed.values()[i];
    const double error = std::abs(double{got} - expected[i]);
    if (!(error <= tolerance)) {  // also true if the error is NaN
      throw BadInput(Concat(file.where(), ": self-check: expected ", what, " ", expected[i],
                            " up to ", tolerance, ", got ", got, " (sample ", i / computed.cols(),
                            ")"));
    }
    check.error = std::max(check.error, error);
  }
}

/// Whether `torque` is one of `torques` (Q) and its preference (Q) is at most `margin` below the
/// largest one. Another machine may choose differently between nearly equal preferences.
bool MayChoose(std::span<const double> torques, double torque, std::span<const float> preferences,
               double margin) {
  const double best = preferences[ArgMax(preferences)];
  for (size_t i = 0; i < torques.size(); ++i) {
    if (torques[i] == torque && best - preferences[i] <= margin) return true;
  }
  return false;
}

/// Reads the rule of a policy file. Throws BadInput unless the file has this format.
ActionRule RuleOf(const Tensors& file) {
  file.ExpectMetadata("format", kFormat);
  file.ExpectMetadata("format_version", kFormatVersion);
  const std::string& name = file.Metadata("output");
  try {
    return ActionRuleCalled(name);
  } catch (const Error& error) {
    throw BadInput(Concat(file.where(), ": output: ", error.what()));
  }
}

/// Reads the networks, torques and limits of a policy file. Throws BadInput, about a network's
/// sizes without the file's name.
NetworkPolicyParts ReadParts(const Tensors& file) {
  NetworkPolicyParts parts;
  parts.rule = RuleOf(file);
  const ActionRuleFacts& rule = parts.facts();
  int outputs = 0;
  if (rule.is_actor()) {
    parts.action_limit = ReadVector(file, "action_limit");
    if (!std::ranges::all_of(parts.action_limit, [](double limit) { return limit > 0; })) {
      throw BadInput(Concat(file.where(), ": tensor \"action_limit\": expected numbers above 0"));
    }
    if (rule.chooses_torque()) parts.torques = ReadVector(file, "torques");
    outputs = static_cast<int>(parts.torques.empty() ? 2 * parts.action_limit.size()
                                                     : parts.torques.size());
  }
  parts.shape = ShapeFromJson(file, "network", rule, outputs);
  if (!rule.is_actor()) {
    parts.torques = ReadFinite<double>(file, "torques", {parts.shape.outputs});
  }
  const Network network(parts.shape);
  ExpectParameters(file, "", network);
  if (rule.is_actor() && file.metadata.contains("critic")) {
    parts.critic = ShapeFromJson(file, "critic", rule, 1);
    const Network critic(parts.critic);
    ExpectParameters(file, kCriticPrefix, critic);
    parts.critic_parameters = ReadParameters(file, kCriticPrefix, critic);
  }
  parts.parameters = ReadParameters(file, "", network);
  return parts;
}

}  // namespace

Tensors NetworkPolicy::ToTensors() const {
  Rng rng(0, "policy self-check");
  std::vector<float> obs(kSamples * obs_size());
  for (float& x : obs) x = static_cast<float>(rng.Uniform(-1, 1));
  const SampleResults results(*this, {obs.data(), kSamples, obs_size()});

  Tensors file;
  file.metadata = PolicyMetadata(info_);
  file.metadata["format"] = kFormat;
  file.metadata["format_version"] = kFormatVersion;
  file.metadata["output"] = std::string(parts_.facts().name);
  file.metadata["network"] = ShapeToJson(parts_.shape, parts_.facts());
  AddParameters(file, "", network_, parts_.parameters);
  if (is_actor()) file.AddCopy<double>("action_limit", parts_.action_limit);
  if (!parts_.torques.empty()) file.AddCopy<double>("torques", parts_.torques);
  const auto [output_name, action_name] = NamesFor(parts_.facts());
  file.AddCopy<float>("sample.obs", obs, {kSamples, obs_size()});
  file.AddCopy<float>(output_name, results.outputs, {kSamples, num_outputs()});
  file.AddCopy<double>(action_name, results.actions, ActionShape(parts_, kSamples));
  if (!critic_) return file;
  file.metadata["critic"] = ShapeToJson(parts_.critic, parts_.facts());
  AddParameters(file, kCriticPrefix, *critic_, parts_.critic_parameters);
  file.AddCopy<float>("sample.value", results.values, {kSamples, 1});
  return file;
}

NetworkPolicy NetworkPolicy::From(const Tensors& file) {
  const std::string& where = file.where();
  try {
    NetworkPolicy policy(ReadParts(file), ParsePolicyInfo(file.metadata, where));
    policy.CheckSamples(file);
    return policy;
  } catch (const Error& error) {
    const std::string message = error.what();
    throw BadInput(message.starts_with(where) ? message : Concat(where, ": ", message));
  }
}

void NetworkPolicy::CheckSamples(const Tensors& file) {
  const auto [output_name, action_name] = NamesFor(parts_.facts());
  const int D = obs_size(), A = action_size();
  const auto numbers = static_cast<int64_t>(file.Count<double>(action_name));
  const auto samples = static_cast<int>(std::min<int64_t>(numbers / A, kMostSamples + 1));
  if (samples < 1 || samples > kMostSamples || numbers % A != 0) {
    throw BadInput(Concat(file.where(), ": tensor \"", action_name, "\": expected 1 to ",
                          kMostSamples, " samples to check, got ", numbers / A));
  }
  const std::vector<float> obs = ReadFinite<float>(file, "sample.obs", {samples, D});
  const std::vector<double> stored =
      ReadFinite<double>(file, action_name, ActionShape(parts_, samples));
  file.Expect(output_name, Dtype::kF32, {samples, num_outputs()});
  const SampleResults results(*this, {obs.data(), samples, D});
  self_check_.has_checksum = file.has_checksum;
  CheckOutputs(file, output_name, results.output_rows, is_actor() ? "output" : "Q-value",
               self_check_);
  for (size_t i = 0; i < stored.size(); ++i) {
    const double got = results.actions[i];
    const auto row = results.output_rows.row(static_cast<int>(i) / A);
    const auto near = [&](double limit) {
      return std::abs(stored[i] - got) <= limit * std::max(self_check_.tolerance, 1e-9);
    };
    if (parts_.facts().chooses_torque()
            ? MayChoose(parts_.torques, stored[i], row, 2 * self_check_.tolerance)
            : near(parts_.action_limit[i % A])) {
      continue;
    }
    throw BadInput(Concat(file.where(), ": self-check: expected action ", FormatNumber(stored[i]),
                          ", got ", FormatNumber(got), " (sample ", i / A, ")"));
  }
  if (critic_) CheckOutputs(file, "sample.value", results.value_rows, "value", self_check_);
}

}  // namespace upswing
