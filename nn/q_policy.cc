#include "nn/q_policy.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/finite.h"
#include "core/json.h"
#include "core/tensors.h"
#include "core/text.h"
#include "nn/linear.h"

namespace upswing {
namespace {

using nlohmann::json;

constexpr std::string_view kFormat = "upswing-policy";
constexpr std::string_view kFormatVersion = "1";
constexpr int kBlock = 128;   // rows in one forward pass: the activations stay in the L2 cache
constexpr int kSamples = 16;  // stored inputs and outputs
constexpr size_t kMostSamples = 64;  // that a file of another writer may have

// Up to which share of the largest Q-value two machines may differ, which sum in other orders. The
// vector paths (AVX-512, AVX2, portable) differ among each other by at most 3e-7 for the networks
// that come with the page and by 1.1e-6 for random ones of up to 16 layers or 4096 units; single
// from double precision by 4e-7 and 2.3e-6.
constexpr double kTolerance = 1e-5;

/// Buffers of a forward pass of a block of rows.
struct Workspace : Policy::Memory {
  QNetwork<float>::Activations activations;
  AlignedVector<float> preferences;  // (block × Q)
};

/// Sample observations (kSamples × D), the same for every policy: uniform in ±1.
std::vector<float> SampleObservations(int obs_size) {
  Rng rng(0, "policy self-check");
  std::vector<float> obs(static_cast<size_t>(kSamples) * static_cast<size_t>(obs_size));
  for (float& x : obs) x = static_cast<float>(rng.Uniform(-1, 1));
  return obs;
}

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

/// The shape of a parameter array in the file: weights are (out, in), as torch.nn.Linear has them.
std::vector<int64_t> FileShape(const ParameterBlock& block) {
  if (block.in == 0) return {block.out};
  return {block.out, block.in};
}

/// The network of a file. Throws if it has sizes that none has.
QNetwork<float> NetworkOf(const QNetworkShape& shape, const std::string& path) {
  try {
    return QNetwork<float>(shape);
  } catch (const Error& error) {
    throw BadInput(Concat(path, ": ", error.what()));
  }
}

/// A file's tensor of this shape, with finite numbers. Throws BadInput.
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

/// How many samples there are to check. Throws BadInput.
size_t CountSamples(const Tensors& file) {
  const size_t samples = file.Count<double>("sample.torque");
  if (samples >= 1 && samples <= kMostSamples) return samples;
  throw BadInput(Concat(file.where(), ": tensor \"sample.torque\": expected 1 to ", kMostSamples,
                        " samples to check, got ", samples));
}

}  // namespace

int ArgMax(std::span<const float> values) {
  return static_cast<int>(std::max_element(values.begin(), values.end()) - values.begin());
}

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

Tensors QPolicy::ToTensors() const {
  const std::string problem = FindNotFinite<float>(parameters_);
  if (!problem.empty()) throw Failure(Concat("policy parameters: ", problem));
  const int inputs = shape().inputs;
  const int count = shape().actions;
  const std::vector<float> obs = SampleObservations(inputs);
  std::vector<float> q(static_cast<size_t>(kSamples) * static_cast<size_t>(count));
  const Matrix<float> q_rows(q.data(), kSamples, count);
  std::vector<double> torque(kSamples);
  Values(Matrix<const float>(obs.data(), kSamples, inputs), q_rows, *Start(kSamples));
  for (int i = 0; i < kSamples; ++i) {
    torque[static_cast<size_t>(i)] = torques_[static_cast<size_t>(ArgMax(q_rows.row(i)))];
  }

  Tensors file;
  file.metadata = PolicyMetadata(info_);
  file.metadata["format"] = kFormat;
  file.metadata["format_version"] = kFormatVersion;
  file.metadata["output"] = "levels";
  file.metadata["network"] = ShapeToJson(shape());
  std::vector<float> in_file(parameters_.size());
  for (const ParameterBlock& block : network_.blocks()) {
    const Matrix<const float> values(parameters_.data() + block.offset, std::max(1, block.in),
                                     block.out);
    const auto array = std::span(in_file).subspan(block.offset, block.size());
    Transpose(values, Matrix<float>(array, values.cols(), values.rows()));
    file.AddCopy<float>(block.name, array, FileShape(block));
  }
  file.AddCopy<double>("torques", torques_);
  file.AddCopy<float>("sample.obs", obs, {kSamples, inputs});
  file.AddCopy<float>("sample.q", q, {kSamples, count});
  file.AddCopy<double>("sample.torque", torque);
  return file;
}

QPolicy QPolicy::From(const Tensors& file) {
  const std::string& where = file.where();
  const auto expect = [&](const std::string& key, std::string_view expected) {
    if (file.Metadata(key) != expected) {
      throw BadInput(Concat(where, ": ", key, ": expected \"", expected, "\", got \"",
                            file.Metadata(key), "\""));
    }
  };
  expect("format", kFormat);
  expect("format_version", kFormatVersion);
  expect("output", "levels");

  // All tensors are looked at before there is room made for any, so that the file is as long as
  // what it asks for.
  const QNetworkShape shape = ShapeFromJson(file.Metadata("network"), where);
  const QNetwork<float> network = NetworkOf(shape, where);
  for (const ParameterBlock& block : network.blocks()) {
    file.Expect(block.name, Dtype::kF32, FileShape(block));
  }
  std::vector<double> torques = ReadFinite<double>(file, "torques", {shape.actions});
  std::vector<float> parameters(network.num_parameters());
  for (const ParameterBlock& block : network.blocks()) {
    const std::vector<float> array = ReadFinite<float>(file, block.name, FileShape(block));
    const Matrix<float> values(parameters.data() + block.offset, std::max(1, block.in), block.out);
    Transpose(Matrix<const float>(array, values.cols(), values.rows()), values);
  }
  QPolicy policy(shape, std::move(parameters), std::move(torques),
                 ParsePolicyInfo(file.metadata, where));

  policy.CheckSamples(file);
  return policy;
}

void QPolicy::CheckSamples(const Tensors& file) {
  const auto samples = static_cast<int>(CountSamples(file));
  const int inputs = shape().inputs;
  const int actions = shape().actions;
  const std::vector<float> obs = ReadFinite<float>(file, "sample.obs", {samples, inputs});
  const std::vector<float> expected = ReadFinite<float>(file, "sample.q", {samples, actions});
  const std::vector<double> torque = ReadFinite<double>(file, "sample.torque", {samples});
  std::vector<float> q(expected.size());
  const Matrix<float> q_rows(q.data(), samples, actions);
  Values(Matrix<const float>(obs.data(), samples, inputs), q_rows, *Start(samples));

  double largest = 0;
  for (const float x : expected) largest = std::max(largest, std::abs(double{x}));
  self_check_ = {file.has_checksum, 0, kTolerance * largest};
  for (size_t i = 0; i < q.size(); ++i) {
    const double error = std::abs(double{q[i]} - expected[i]);
    if (!(error <= self_check_.tolerance)) {  // nor if it is not a number
      throw BadInput(Concat(file.where(), ": self-check: expected Q-value ", expected[i], " up to ",
                            self_check_.tolerance, ", got ", q[i], " (sample ",
                            i / static_cast<size_t>(actions), ")"));
    }
    self_check_.error = std::max(self_check_.error, error);
  }
  for (int i = 0; i < samples; ++i) {
    const double stored = torque[static_cast<size_t>(i)];
    if (!MayChoose(stored, q_rows.row(i))) {
      throw BadInput(Concat(file.where(), ": self-check: expected torque ", stored, ", got ",
                            torques_[static_cast<size_t>(ArgMax(q_rows.row(i)))], " (sample ", i,
                            ")"));
    }
  }
}

bool QPolicy::MayChoose(double torque, std::span<const float> q) const {
  const double best = q[static_cast<size_t>(ArgMax(q))];
  for (size_t action = 0; action < q.size(); ++action) {
    if (torques_[action] == torque && best - q[action] <= 2 * self_check_.tolerance) return true;
  }
  return false;
}

}  // namespace upswing
