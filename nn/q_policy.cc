#include "nn/q_policy.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/argmax.h"
#include "core/error.h"
#include "core/json.h"
#include "core/tensors.h"
#include "core/text.h"

namespace upswing {
namespace {

using nlohmann::json;

constexpr std::string_view kOutput = "levels";
constexpr int kBlock = 128;  // rows in one forward pass: the activations stay in the L2 cache

/// Buffers of a forward pass of a block of rows.
struct Workspace : Policy::Memory {
  QNetwork<float>::Activations activations;
  AlignedVector<float> preferences;  // (block × Q)
};

/// What makes the network, as the metadata hold it.
std::string ShapeToJson(const QNetworkShape& shape) {
  return json{{"inputs", shape.inputs},   {"actions", shape.actions},
              {"hidden", shape.hidden},   {"head", shape.head},
              {"dueling", shape.dueling}, {"layer_norm", shape.layer_norm}}
      .dump();
}

/// The network's shape from a file's metadata. Throws BadInput.
QNetworkShape ShapeFromJson(const std::string& text, const std::string& path) {
  try {
    const json j = ParseJsonObject(text);
    constexpr int64_t kMax = QNetworkShape::kMaxWidth;
    QNetworkShape shape{static_cast<int>(JsonInteger(j, "inputs", 1, kMax)),
                        static_cast<int>(JsonInteger(j, "actions", 1, kMax)),
                        {},
                        JsonInteger(j, "head", 0, kMax),
                        JsonBool(j, "dueling"),
                        JsonBool(j, "layer_norm")};
    for (const json& width : JsonList(j, "hidden", QNetworkShape::kMaxLayers)) {
      // What is no integer is no width either.
      shape.hidden.push_back(JsonInteger(width).value_or(0));
    }
    return shape;
  } catch (const Error& error) {
    throw BadInput(Concat(path, ": metadata \"network\": ", error.what()));
  }
}

/// The network of a file. Throws if it has sizes that none has.
QNetwork<float> NetworkOf(const QNetworkShape& shape, const std::string& path) {
  try {
    return QNetwork<float>(shape);
  } catch (const Error& error) {
    throw BadInput(Concat(path, ": ", error.what()));
  }
}

}  // namespace

QPolicy::QPolicy(QNetworkShape shape, std::vector<float> parameters, std::vector<double> torques,
                 PolicyInfo info)
    : network_(std::move(shape)),
      parameters_(parameters.begin(), parameters.end()),
      torques_(std::move(torques)),
      info_(std::move(info)) {
  if (parameters_.size() != network_.num_parameters() ||
      torques_.size() != static_cast<size_t>(network_.shape().actions)) {
    throw BadInput(Concat("policy: expected ", network_.num_parameters(), " parameters and ",
                          network_.shape().actions, " torques, got ", parameters_.size(), " and ",
                          torques_.size()));
  }
}

std::string QPolicy::description() const {
  const QNetworkShape& s = shape();
  std::string layers = std::to_string(s.inputs);
  for (const int64_t width : s.hidden) layers += Concat('-', width);
  const std::string output = s.dueling ? Concat('(', s.head, "→1, ", s.head, "→", s.actions, ')')
                                       : std::to_string(s.actions);
  return Concat("greedy policy of a ", s.dueling ? "dueling" : "plain", " Q-network ", layers, '-',
                output, s.layer_norm ? ", layer normalisation" : "");
}

std::unique_ptr<Policy::Memory> QPolicy::Start(int /*num_envs*/) const {
  const auto count = static_cast<size_t>(network_.shape().actions);
  auto workspace = std::make_unique<Workspace>();
  workspace->activations = network_.MakeActivations(kBlock, false);
  workspace->preferences.resize(kBlock * count);
  return workspace;
}

void QPolicy::Values(Matrix<const float> obs, Matrix<float> q, Memory& memory) const {
  auto& activations = static_cast<Workspace&>(memory).activations;
  for (int first = 0; first < obs.rows(); first += kBlock) {
    const int rows = std::min(kBlock, obs.rows() - first);
    network_.Forward({parameters_}, obs.Rows(first, rows), {0, rows}, activations,
                     q.Rows(first, rows));
  }
}

void QPolicy::Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const {
  auto& workspace = static_cast<Workspace&>(memory);
  for (int first = 0; first < obs.rows(); first += kBlock) {
    const int rows = std::min(kBlock, obs.rows() - first);
    const Matrix<float> preferences(workspace.preferences, rows, network_.shape().actions);
    network_.ForwardPreferences(parameters_, obs.Rows(first, rows), {0, rows},
                                workspace.activations, preferences);
    for (int i = 0; i < rows; ++i) {
      action(first + i, 0) = torques_[static_cast<size_t>(ArgMax(preferences.row(i)))];
    }
  }
}

QPolicy QPolicy::Rounded() const {
  std::vector<float> parameters(parameters_.begin(), parameters_.end());
  for (float& x : parameters) {
    // To nearest, ties to even; what is not finite is refused when it is written.
    const auto bits = std::bit_cast<uint32_t>(x);
    x = std::bit_cast<float>((bits + 0x7fff + (bits >> 16 & 1)) & 0xffff0000);
  }
  return QPolicy(shape(), std::move(parameters), torques_, info_);
}

Tensors QPolicy::ToTensors() const {
  const int inputs = shape().inputs;
  const int count = shape().actions;
  const std::vector<float> obs = SampleObservations(inputs);
  std::vector<float> q(static_cast<size_t>(kPolicySamples) * static_cast<size_t>(count));
  const Matrix<float> q_rows(q.data(), kPolicySamples, count);
  std::vector<double> torque(kPolicySamples);
  Values(Matrix<const float>(obs.data(), kPolicySamples, inputs), q_rows, *Start(kPolicySamples));
  for (int i = 0; i < kPolicySamples; ++i) {
    torque[static_cast<size_t>(i)] = torques_[static_cast<size_t>(ArgMax(q_rows.row(i)))];
  }

  Tensors file = BeginPolicyFile(info_, kOutput);
  file.metadata["network"] = ShapeToJson(shape());
  AddParameters(file, "", network_.blocks(), parameters_);
  file.AddCopy<double>("torques", torques_);
  file.AddCopy<float>("sample.obs", obs, {kPolicySamples, inputs});
  file.AddCopy<float>("sample.q", q, {kPolicySamples, count});
  file.AddCopy<double>("sample.torque", torque);
  return file;
}

QPolicy QPolicy::From(const Tensors& file) {
  const std::string& where = file.where();
  const std::string& output = PolicyOutput(file);
  if (output != kOutput) {
    throw BadInput(Concat(where, ": output: expected \"", kOutput, "\", got \"", output, "\""));
  }
  const QNetworkShape shape = ShapeFromJson(file.Metadata("network"), where);
  const QNetwork<float> network = NetworkOf(shape, where);
  ExpectParameters(file, "", network.blocks());
  std::vector<double> torques = ReadFinite<double>(file, "torques", {shape.actions});
  QPolicy policy(shape, ReadParameters(file, "", network.blocks()), std::move(torques),
                 ParsePolicyInfo(file.metadata, where));
  policy.CheckSamples(file);
  return policy;
}

void QPolicy::CheckSamples(const Tensors& file) {
  const int samples = CountSamples(file, "sample.torque", 1);
  const int inputs = shape().inputs;
  const int actions = shape().actions;
  const std::vector<float> obs = ReadFinite<float>(file, "sample.obs", {samples, inputs});
  const std::vector<double> torque = ReadFinite<double>(file, "sample.torque", {samples});
  file.Expect("sample.q", Dtype::kF32, {samples, actions});
  std::vector<float> q(static_cast<size_t>(samples) * static_cast<size_t>(actions));
  const Matrix<float> q_rows(q.data(), samples, actions);
  Values(Matrix<const float>(obs.data(), samples, inputs), q_rows, *Start(samples));
  upswing::CheckSamples(file, "sample.q", q_rows, "Q-value", self_check_);
  for (int i = 0; i < samples; ++i) {
    const double stored = torque[static_cast<size_t>(i)];
    if (!MayChoose(torques_, stored, q_rows.row(i), 2 * self_check_.tolerance)) {
      throw BadInput(Concat(file.where(), ": self-check: expected torque ", stored, ", got ",
                            torques_[static_cast<size_t>(ArgMax(q_rows.row(i)))], " (sample ", i,
                            ")"));
    }
  }
}

}  // namespace upswing
