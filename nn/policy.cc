#include "nn/policy.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/finite.h"
#include "core/tensor_file.h"
#include "core/text.h"
#include "nn/linear.h"

namespace upswing {
namespace {

using nlohmann::json;

constexpr std::string_view kFormat = "upswing-policy";
constexpr std::string_view kFormatVersion = "1";
constexpr int kBlock = 128;   // rows in one forward pass: the activations stay in the L2 cache
constexpr int kSamples = 16;  // stored inputs and outputs

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

QNetworkShape ShapeFromJson(const std::string& text, const std::string& path) {
  try {
    const json j = json::parse(text);
    return {j.at("inputs").get<int>(),
            j.at("actions").get<int>(),
            j.at("hidden").get<std::vector<int64_t>>(),
            j.at("head").get<int64_t>(),
            j.at("dueling").get<bool>(),
            j.at("layer_norm").get<bool>()};
  } catch (const json::exception& error) {
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

/// Throws BadInput unless every number of a file's tensor is finite.
template <typename T>
void CheckFinite(std::span<const T> values, const std::string& path, const std::string& tensor) {
  const std::string problem = FindNotFinite(values);
  if (!problem.empty()) throw BadInput(Concat(path, ": tensor \"", tensor, "\": ", problem));
}

}  // namespace

int ArgMax(std::span<const float> values) {
  return static_cast<int>(std::max_element(values.begin(), values.end()) - values.begin());
}

Policy::Policy(QNetworkShape shape, std::vector<float> parameters, std::vector<double> torques,
               std::map<std::string, std::string> about)
    : network_(std::move(shape)),
      parameters_(parameters.begin(), parameters.end()),
      torques_(std::move(torques)),
      about_(std::move(about)),
      workspace_(MakeWorkspace()) {
  if (parameters_.size() != network_.num_parameters() ||
      torques_.size() != static_cast<size_t>(network_.shape().actions)) {
    throw BadInput(Concat("policy: expected ", network_.num_parameters(), " parameters and ",
                          network_.shape().actions, " torques, got ", parameters_.size(), " and ",
                          torques_.size()));
  }
}

const std::string& Policy::About(const std::string& key) const {
  const auto found = about_.find(key);
  if (found == about_.end()) throw BadInput(Concat("policy: no metadata \"", key, "\""));
  return found->second;
}

void Policy::QValues(Matrix<const float> obs, Matrix<float> q, Workspace& workspace) const {
  for (int first = 0; first < obs.rows(); first += kBlock) {
    const int rows = std::min(kBlock, obs.rows() - first);
    network_.Forward({parameters_}, obs.Rows(first, rows), {0, rows}, workspace.activations,
                     q.Rows(first, rows));
  }
}

Policy::Workspace Policy::MakeWorkspace() const {
  const auto actions = static_cast<size_t>(network_.shape().actions);
  return {network_.MakeActivations(kBlock, false), AlignedVector<float>(kBlock * actions)};
}

void Policy::Act(Matrix<const float> obs, std::span<double> torque, Workspace& workspace) const {
  for (int first = 0; first < obs.rows(); first += kBlock) {
    const int rows = std::min(kBlock, obs.rows() - first);
    const Matrix<float> preferences(workspace.preferences, rows, network_.shape().actions);
    network_.ForwardPreferences(parameters_, obs.Rows(first, rows), {0, rows},
                                workspace.activations, preferences);
    for (int i = 0; i < rows; ++i) {
      const auto action = static_cast<size_t>(ArgMax(preferences.row(i)));
      torque[static_cast<size_t>(first + i)] = torques_[action];
    }
  }
}

void Policy::Save(const std::filesystem::path& path) const {
  const std::string problem = FindNotFinite<float>(parameters_);
  if (!problem.empty()) throw Failure(Concat("policy parameters: ", problem));
  const int inputs = shape().inputs;
  const int actions = shape().actions;
  const std::vector<float> obs = SampleObservations(inputs);
  std::vector<float> q(static_cast<size_t>(kSamples) * static_cast<size_t>(actions));
  std::vector<double> torque(kSamples);
  const Matrix<const float> obs_rows(obs.data(), kSamples, inputs);
  QValues(obs_rows, Matrix<float>(q.data(), kSamples, actions));
  for (int i = 0; i < kSamples; ++i) {
    const auto row = std::span<const float>(q).subspan(static_cast<size_t>(i * actions),
                                                       static_cast<size_t>(actions));
    torque[static_cast<size_t>(i)] = torques_[static_cast<size_t>(ArgMax(row))];
  }

  TensorFile file;
  file.metadata = about_;
  file.metadata["format"] = kFormat;
  file.metadata["format_version"] = kFormatVersion;
  file.metadata["output"] = "levels";
  file.metadata["network"] = ShapeToJson(shape());
  std::vector<float> in_file(parameters_.size());  // the file refers to it until it is saved
  for (const ParameterBlock& block : network_.blocks()) {
    const Matrix<const float> values(parameters_.data() + block.offset, std::max(1, block.in),
                                     block.out);
    const auto array = std::span(in_file).subspan(block.offset, block.size());
    Transpose(values, Matrix<float>(array, values.cols(), values.rows()));
    file.Add<float>(block.name, array, FileShape(block));
  }
  file.Add<double>("torques", torques_);
  file.Add<float>("sample.obs", obs, {kSamples, inputs});
  file.Add<float>("sample.q", q, {kSamples, actions});
  file.Add<double>("sample.torque", torque);
  file.Save(path);
}

Policy Policy::From(const TensorFile& file) {
  const std::string& where = file.path();
  const auto expect = [&](const std::string& key, std::string_view expected) {
    if (file.Metadata(key) != expected) {
      throw BadInput(Concat(where, ": ", key, ": expected \"", expected, "\", got \"",
                            file.Metadata(key), "\""));
    }
  };
  expect("format", kFormat);
  expect("format_version", kFormatVersion);
  expect("output", "levels");

  // Parameters, each with the shape that the network asks for.
  const QNetworkShape shape = ShapeFromJson(file.Metadata("network"), where);
  const QNetwork<float> network = NetworkOf(shape, where);
  std::vector<float> parameters(network.num_parameters());
  std::vector<float> array;
  for (const ParameterBlock& block : network.blocks()) {
    array.resize(block.size());
    file.Read(block.name, std::span(array), FileShape(block));
    CheckFinite<float>(array, where, block.name);
    const Matrix<float> values(parameters.data() + block.offset, std::max(1, block.in), block.out);
    Transpose<float>(Matrix<float>(array, values.cols(), values.rows()), values);
  }
  std::vector<double> torques(static_cast<size_t>(shape.actions));
  file.Read("torques", std::span(torques));
  CheckFinite<double>(torques, where, "torques");
  Policy policy(shape, std::move(parameters), std::move(torques), file.metadata);

  policy.CheckSamples(file);
  return policy;
}

void Policy::CheckSamples(const TensorFile& file) {
  const auto inputs = static_cast<size_t>(shape().inputs);
  const auto actions = static_cast<size_t>(shape().actions);
  const size_t samples = file.Count<double>("sample.torque");
  if (samples == 0) throw BadInput(Concat(file.path(), ": expected samples to check, got none"));
  std::vector<float> obs(samples * inputs);
  std::vector<float> expected(samples * actions);
  std::vector<float> q(expected.size());
  std::vector<double> torque(samples);
  file.Read("sample.obs", std::span(obs));
  file.Read("sample.q", std::span(expected));
  file.Read("sample.torque", std::span(torque));
  const int rows = static_cast<int>(samples);
  QValues(Matrix<const float>(obs.data(), rows, shape().inputs),
          Matrix<float>(q.data(), rows, shape().actions));

  // Another machine may sum in another order, but not differ by more than rounding.
  const auto tolerance = [](double x) { return 1e-4 * (1.0 + std::abs(x)); };
  for (size_t i = 0; i < q.size(); ++i) {
    const double error = std::abs(static_cast<double>(q[i]) - expected[i]);
    if (!(error <= tolerance(expected[i]))) {
      throw BadInput(Concat(file.path(), ": self-check: expected Q-value ", expected[i], ", got ",
                            q[i], " (sample ", i / actions, ")"));
    }
    self_check_error_ = std::max(self_check_error_, error);
  }
  // The torque is that of the largest Q-value, or of one that rounding cannot tell from it.
  for (size_t i = 0; i < samples; ++i) {
    const auto row = std::span(q).subspan(i * actions, actions);
    const float best = row[static_cast<size_t>(ArgMax(row))];
    const auto level = std::ranges::find(torques_, torque[i]) - torques_.begin();
    if (static_cast<size_t>(level) == actions ||
        best - row[static_cast<size_t>(level)] > 2 * tolerance(best)) {
      throw BadInput(Concat(file.path(), ": self-check: expected torque ", torque[i], ", got ",
                            torques_[static_cast<size_t>(ArgMax(row))], " (sample ", i, ")"));
    }
  }
}

}  // namespace upswing
