#include <onnx.pb.h>  // generated from extras/deploy/onnx.proto

#include <bit>
#include <limits>
#include <nlohmann/json.hpp>
#include <variant>

#include "base/error.h"
#include "base/text.h"
#include "extras/deploy/export.h"
#include "extras/deploy/exported_policy.h"
#include "nn/gaussian.h"
#include "nn/linear.h"

namespace upswing::deploy {
namespace {

using nlohmann::ordered_json;

constexpr int64_t kOpset = 17;     // first opset with LayerNormalization
constexpr int64_t kIrVersion = 8;  // IR version of opset 17

static_assert(std::endian::native == std::endian::little, "raw_data is little-endian");

/// A model in the ONNX format (https://onnx.ai), built node by node. Inputs and outputs are float
/// matrices (batch × size) with any number of rows. Texts must be UTF-8.
class OnnxModel {
 public:
  explicit OnnxModel(const std::string& description) {
    model_.set_ir_version(kIrVersion);
    model_.set_producer_name("upswing");
    model_.set_producer_version(UPSWING_VERSION);
    model_.set_doc_string(description);
    graph_.set_name("policy");
    auto& opset = *model_.add_opset_import();
    opset.set_domain("");
    opset.set_version(kOpset);
  }

  /// Adds an input, or an output that is made by the node of the same name.
  void AddInput(const std::string& name, int size, const std::string& description) {
    SetMatrix(*graph_.add_input(), name, size, description);
  }
  void AddOutput(const std::string& name, int size, const std::string& description) {
    SetMatrix(*graph_.add_output(), name, size, description);
  }

  /// Adds a row-major array of constants and returns its name.
  std::string AddConstant(const std::string& name, std::span<const float> values,
                          const std::vector<int64_t>& shape) {
    auto& tensor = *graph_.add_initializer();
    tensor.set_name(name);
    tensor.set_data_type(onnx::TensorProto::FLOAT);
    for (const int64_t size : shape) tensor.add_dims(size);
    tensor.set_raw_data(values.data(), values.size_bytes());
    return name;
  }

  using Attribute = std::variant<int64_t, float, std::vector<int64_t>>;
  using Attributes = std::vector<std::pair<std::string, Attribute>>;
  /// Adds an operator on the arrays called `inputs`. Returns `name`, the name of its result.
  std::string AddNode(const std::string& name, const std::string& op,
                      const std::vector<std::string>& inputs, const Attributes& attributes = {}) {
    auto& node = *graph_.add_node();
    node.set_name(name);
    node.set_op_type(op);
    for (const std::string& input : inputs) node.add_input(input);
    node.add_output(name);
    for (const auto& [key, value] : attributes) {
      auto& attribute = *node.add_attribute();
      attribute.set_name(key);
      if (const auto* i = std::get_if<int64_t>(&value)) {
        attribute.set_type(onnx::AttributeProto::INT);
        attribute.set_i(*i);
      } else if (const auto* f = std::get_if<float>(&value)) {
        attribute.set_type(onnx::AttributeProto::FLOAT);
        attribute.set_f(*f);
      } else {
        attribute.set_type(onnx::AttributeProto::INTS);
        for (const int64_t i : std::get<std::vector<int64_t>>(value)) attribute.add_ints(i);
      }
    }
    return name;
  }

  void AddMetadata(const std::string& key, const std::string& text) {
    auto& entry = *model_.add_metadata_props();
    entry.set_key(key);
    entry.set_value(text);
  }

  /// The bytes of the file. Throws BadInput if they exceed protobuf's limit of 2 GiB.
  std::string Bytes() const {
    if (model_.ByteSizeLong() > size_t{std::numeric_limits<int32_t>::max()}) {
      throw BadInput("ONNX: expected a policy of less than 2 GiB");
    }
    return model_.SerializeAsString();
  }

 private:
  static void SetMatrix(onnx::ValueInfoProto& value, const std::string& name, int size,
                        const std::string& description) {
    value.set_name(name);
    value.set_doc_string(description);
    auto& tensor = *value.mutable_type()->mutable_tensor_type();
    tensor.set_elem_type(onnx::TensorProto::FLOAT);
    tensor.mutable_shape()->add_dim()->set_dim_param("batch");
    tensor.mutable_shape()->add_dim()->set_dim_value(size);
  }

  onnx::ModelProto model_;
  onnx::GraphProto& graph_ = *model_.mutable_graph();
};

constexpr const char* kInput = "observation";
/// The output with the action.
const char* ActionName(const ExportedPolicy& policy) {
  return policy.is_foreign() ? "action" : "torque";
}
/// The name of a discrete policy's actions, for descriptions of outputs.
const char* ChoicesText(const ExportedPolicy& policy) {
  return policy.is_foreign() ? "action of the metadata `actions`"
                             : "torque of the metadata `torques`";
}
/// The action in units of its limit, within the model.
const char* UnitActionName(const ExportedPolicy& policy) {
  return policy.is_foreign() ? "unit_action" : "action";
}

/// Adds y = activation(norm(W x + b)). Returns y's name, `name`.
std::string AddLayer(OnnxModel& model, const LayerView& layer, const std::string& x,
                     const std::string& name) {
  const auto vector = [&](const char* what, std::span<const float> values) {
    return model.AddConstant(name + what, values, {layer.out()});
  };
  std::vector<float> weight(layer.W.size());
  Transpose(layer.W, Matrix<float>(weight, layer.out(), layer.in()));
  const bool active = layer.activation != Activation::kNone;
  std::string y =
      model.AddNode(active || layer.layer_norm() ? name + ".linear" : name, "Gemm",
                    {x, model.AddConstant(name + ".weight", weight, {layer.out(), layer.in()}),
                     vector(".bias", layer.b)},
                    {{"transB", int64_t{1}}});
  if (layer.layer_norm()) {
    y = model.AddNode(
        active ? name + ".norm" : name, "LayerNormalization",
        {y, vector(".norm.weight", layer.gain), vector(".norm.bias", layer.norm_bias)},
        {{"axis", int64_t{-1}}, {"epsilon", kLayerNormEpsilon}});
  }
  if (!active) return y;
  return model.AddNode(name, layer.activation == Activation::kTanh ? "Tanh" : "Relu", {y});
}

/// Adds layers one after the other. Returns the name of the final output: `last`, or the last
/// layer's name if `last` is empty.
std::string AddLayers(OnnxModel& model, std::span<const LayerView> layers, std::string x,
                      const std::string& last = "") {
  for (const LayerView& layer : layers) {
    const bool is_last = &layer == &layers.back() && !last.empty();
    x = AddLayer(model, layer, x, is_last ? last : layer.name);
  }
  return x;
}

/// Adds the output of the action: the torque with the largest preference.
void AddChoice(OnnxModel& model, const ExportedPolicy& policy, const std::string& preferences) {
  const std::vector<float> torques(policy.torques().begin(), policy.torques().end());
  const std::string table =
      model.AddConstant("torques", torques, {static_cast<int64_t>(torques.size())});
  const std::string index = model.AddNode("choice", "ArgMax", {preferences},
                                          {{"axis", int64_t{1}}, {"keepdims", int64_t{1}}});
  model.AddNode(ActionName(policy), "Gather", {table, index}, {{"axis", int64_t{0}}});
}

void AddQNetwork(OnnxModel& model, const ExportedPolicy& policy) {
  const NetworkShape& shape = policy.policy->parts().shape;
  const std::span<const LayerView> layers = policy.layers;
  model.AddOutput("q_values", shape.outputs, Concat("Q-value of each ", ChoicesText(policy)));
  if (!shape.dueling())
    return AddChoice(model, policy, AddLayers(model, layers, kInput, "q_values"));
  const std::string features = AddLayers(model, layers.first(shape.hidden.size()), kInput);
  // Q = V + A - mean(A) (Wang et al., 2016, Eq 9). Its argmax is the argmax of A.
  const std::string advantages = AddLayers(model, layers.last(2), features);
  const std::string value = AddLayers(model, layers.subspan(shape.hidden.size(), 2), features);
  const std::string mean =
      model.AddNode("advantage.mean", "ReduceMean", {advantages},
                    {{"axes", std::vector<int64_t>{1}}, {"keepdims", int64_t{1}}});
  const std::string above = model.AddNode("advantage.above_mean", "Sub", {advantages, mean});
  model.AddNode("q_values", "Add", {above, value});
  AddChoice(model, policy, advantages);
}

/// Adds the distribution's outputs and the torque. Returns the name of the action in units of its
/// limit, an input of some critics.
std::string AddActor(OnnxModel& model, const ExportedPolicy& policy) {
  const std::span<const LayerView> layers = policy.layers;
  const std::string features = AddLayers(model, layers.first(layers.size() - 1), kInput);
  const LayerView& last = layers.back();
  const std::vector<double>& limits = policy.policy->parts().action_limit;
  const std::vector<float> limit(limits.begin(), limits.end());
  const int A = policy.action_size();
  if (policy.is_discrete()) {
    model.AddOutput("probabilities", last.out(),
                    Concat("with which it drew each ", ChoicesText(policy), " as it learned"));
    const std::string logits = AddLayer(model, last, features, "logits");
    model.AddNode("probabilities", "Softmax", {logits}, {{"axis", int64_t{1}}});
    AddChoice(model, policy, logits);
    if (!policy.critic_takes_action()) return "";
    const std::string whole = model.AddConstant("limit", limit, {A});
    return model.AddNode(UnitActionName(policy), "Div", {ActionName(policy), whole});
  }
  const bool squashed = policy.rule().bound == &kSquash;
  const char* bound = squashed ? "tanh(mean)" : "the mean, cut off at -1 and 1";
  model.AddOutput(
      "mean", A,
      Concat("of the unbounded action; the ", ActionName(policy), " is the limit times ", bound));
  model.AddOutput("log_std", A, "logarithm of its standard deviation as it learned");
  AddLayer(model, last.Units(0, A), features, "mean");
  const std::string raw = AddLayer(model, last.Units(A, A), features, "log_std.raw");
  const auto low = static_cast<float>(kLogStdLow), high = static_cast<float>(kLogStdHigh);
  const auto scalar = [&](const char* name, const float& value) {
    return model.AddConstant(name, {&value, 1}, {});
  };
  model.AddNode("log_std", "Clip", {raw, scalar("log_std.low", low), scalar("log_std.high", high)});
  const float minus_one = -1, one = 1;
  std::string action =
      squashed
          ? model.AddNode(UnitActionName(policy), "Tanh", {"mean"})
          : model.AddNode(UnitActionName(policy), "Clip",
                          {"mean", scalar("action.low", minus_one), scalar("action.high", one)});
  model.AddNode(ActionName(policy), "Mul", {action, model.AddConstant("limit", limit, {A})});
  return action;
}

void AddCritic(OnnxModel& model, const ExportedPolicy& policy, const std::string& action) {
  model.AddOutput("value", 1, "estimated sum of gamma^k reward_scale reward from here on");
  std::string input = kInput;
  if (policy.critic_takes_action()) {
    input = model.AddNode("critic.input", "Concat", {kInput, action}, {{"axis", int64_t{1}}});
  }
  AddLayers(model, policy.critic, input, "value");
}

void AddMetadata(OnnxModel& model, const ExportedPolicy& policy) {
  const LoadedPolicy& loaded = *policy.loaded;
  const PolicyInfo& info = loaded.policy->info();
  const auto add = [&](const char* key, const ordered_json& value) {
    model.AddMetadata(key, value.is_string() ? value.get<std::string>() : value.dump());
  };
  const auto add_known = [&](const char* key, const auto& value) {
    if (value) add(key, *value);
  };
  ordered_json observation;
  for (const auto& [name, meaning] : policy.task.observation) {
    observation.push_back({{"name", name}, {"meaning", meaning}});
  }
  add("task", loaded.task);
  add("policy", loaded.policy->description());
  add("observation", observation);
  add("control_period", *info.control_period);
  if (!policy.is_foreign()) add("torque_limit", policy.limit);
  if (policy.is_foreign() && !policy.is_discrete()) {
    add("action_limit", policy.policy->parts().action_limit);
  }
  if (policy.is_discrete()) add(policy.is_foreign() ? "actions" : "torques", policy.torques());
  if (!policy.is_foreign()) {
    ordered_json plant;
    for (const auto& [name, value] : PlantValues(loaded.plant)) plant[name] = value;
    add("plant", plant);
    add("memory_steps", loaded.memory());
  }
  add_known("gamma", info.gamma);
  add_known("reward_scale", info.reward_scale);
  if (!info.agent.empty()) add("agent", info.agent);
  add_known("seed", info.seed);
  add_known("step", info.step);
  add_known("success_rate", info.success_rate);
  add_known("mean_return", info.mean_return);
  add("upswing_version", info.upswing_version.empty() ? UPSWING_VERSION : info.upswing_version);
}

}  // namespace

std::string OnnxModelOf(const LoadedPolicy& loaded) {
  const ExportedPolicy policy = ViewForExport(loaded);
  OnnxModel model(Concat("Upswing, ", loaded.task, ": ", loaded.policy->description()));
  model.AddInput(kInput, policy.obs_size(),
                 "as the task's environment gives it; order and units: metadata `observation`");
  if (policy.rule().is_actor()) {
    const std::string action = AddActor(model, policy);
    if (!policy.critic.empty()) AddCritic(model, policy, action);
  } else {
    AddQNetwork(model, policy);
  }
  model.AddOutput(ActionName(policy), policy.action_size(),
                  policy.is_foreign() ? "of the environment's action space"
                                      : "N m, to hold for the metadata `control_period`, s");
  AddMetadata(model, policy);
  return model.Bytes();
}

}  // namespace upswing::deploy
