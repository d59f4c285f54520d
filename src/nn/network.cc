#include "nn/network.h"

#include <algorithm>
#include <iterator>

#include "base/error.h"
#include "base/text.h"
#include "nn/linear.h"

namespace upswing {
namespace {

constexpr int kTaskRows = 64;  // rows of a weight per task

/// Throws BadInput if a size is invalid. Shapes from settings and from policy files both pass this
/// check.
NetworkShape Checked(NetworkShape shape) {
  constexpr int64_t kMax = NetworkShape::kMaxWidth;
  const auto valid = [](int64_t n) { return n >= 1 && n <= kMax; };
  if (valid(shape.inputs) && valid(shape.outputs) && !shape.hidden.empty() &&
      shape.hidden.size() <= NetworkShape::kMaxLayers && std::ranges::all_of(shape.hidden, valid) &&
      (!shape.dueling() || valid(shape.streams))) {
    return shape;
  }
  throw BadInput(Concat("network: expected 1 to ", NetworkShape::kMaxLayers, " layers of 1 to ",
                        kMax, " units, got inputs ", shape.inputs, ", outputs ", shape.outputs,
                        ", ", shape.hidden.size(), " hidden layers (", Join(shape.hidden, ", "),
                        "), head ", shape.streams));
}

/// y = V + A - mean(A) (Wang et al., 2016, Eq 9).
void CombineStreams(Matrix<const Real> value, Matrix<const Real> advantage, Matrix<Real> y) {
  for (int i = 0; i < y.rows(); ++i) {
    Real mean = 0;
    for (const Real A : advantage.row(i)) mean += A;
    mean /= static_cast<Real>(y.cols());
    for (int k = 0; k < y.cols(); ++k) y(i, k) = advantage(i, k) + (value(i, 0) - mean);
  }
}

/// Backward pass of CombineStreams: dV = sum(dy), dA = dy - mean(dy).
void CombineStreamsBackward(Matrix<const Real> dy, Matrix<Real> dvalue, Matrix<Real> dadvantage) {
  for (int i = 0; i < dy.rows(); ++i) {
    Real sum = 0;
    for (const Real g : dy.row(i)) sum += g;
    dvalue(i, 0) = sum;
    for (int k = 0; k < dy.cols(); ++k) {
      dadvantage(i, k) = dy(i, k) - sum / static_cast<Real>(dy.cols());
    }
  }
}

}  // namespace

std::string NetworkShape::Text() const {
  std::string text = std::to_string(inputs);
  for (const int64_t width : hidden) text += Concat('-', width);
  return dueling() ? Concat(text, "-(", streams, "→1, ", streams, "→", outputs, ')')
                   : Concat(text, '-', outputs);
}

Network::Network(NetworkShape shape) : shape_(Checked(std::move(shape))) {
  int width = shape_.inputs;
  for (size_t i = 0; i < num_hidden(); ++i) {
    const int units = static_cast<int>(shape_.hidden[i]);
    Add(Concat("feature.", i), width, units, shape_.activation, shape_.layer_norm);
    width = units;
  }
  if (!shape_.dueling()) {
    Add("output", width, shape_.outputs);
    return;
  }
  const int G = static_cast<int>(shape_.streams);
  Add("streams", width, 2 * G, Activation::kRelu);
  Add("value", G, 1);
  Add("advantage", G, shape_.outputs);
}

void Network::Add(const std::string& name, int in, int out, Activation activation,
                  bool layer_norm) {
  const size_t offset = blocks_.empty() ? 0 : num_parameters();
  for (int first = 0; first < in; first += kTaskRows) {
    tasks_.push_back({layers_.size(), {first, std::min(kTaskRows, in - first)}});
  }
  layers_.emplace_back(name, in, out, activation, layer_norm, offset);
  std::ranges::copy(layers_.back().Blocks(), std::back_inserter(blocks_));
}

std::vector<LayerView> Network::Views(std::span<const Real> parameters) const {
  std::vector<LayerView> views;
  for (const Layer& layer : layers_) views.push_back(layer.View(parameters));
  if (!shape_.dueling()) return views;
  const int G = static_cast<int>(shape_.streams);
  LayerView value = views[num_hidden()].Units(0, G), advantage = views[num_hidden()].Units(G, G);
  value.name += ".value";
  advantage.name += ".advantage";
  views[num_hidden()] = value;
  views.insert(views.end() - 1, advantage);
  return views;
}

void Network::Initialize(Rng& rng, std::span<Real> parameters) const {
  for (const Layer& layer : layers_) layer.Initialize(rng, parameters);
}

void Network::ShiftOutputs(Real shift, std::span<Real> parameters) const {
  const Layer& values = layers_[shape_.dueling() ? num_hidden() + 1 : num_hidden()];
  for (Real& bias : values.Bias(parameters)) bias += shift;
}

Network::Activations Network::MakeActivations(int max_batch, bool gradients) const {
  Activations a;
  for (const Layer& layer : layers_) a.push_back(layer.MakeActivations(max_batch, gradients));
  return a;
}

Matrix<const Real> Network::Trunk(std::span<const Real> parameters, Matrix<const Real> x,
                                  RowRange rows, Activations& a) const {
  Matrix<const Real> y = x.Rows(rows.first, rows.count);
  for (size_t i = 0; i < num_hidden(); ++i) y = layers_[i].Forward(parameters, y, rows, a[i]);
  return y;
}

void Network::Forward(std::span<const Real> parameters, Matrix<const Real> x, RowRange rows,
                      Activations& a, Matrix<Real> y) const {
  const Matrix<const Real> features = Trunk(parameters, x, rows, a);
  const Matrix<Real> y_rows = y.Rows(rows.first, rows.count);
  const size_t head = num_hidden();
  const Matrix<const Real> first = layers_[head].Forward(parameters, features, rows, a[head]);
  if (!shape_.dueling()) {
    std::ranges::copy(first.values(), y_rows.values().begin());
    return;
  }
  const int G = static_cast<int>(shape_.streams);
  const auto stream = [&](size_t layer, int column) {
    return layers_[layer].Forward(parameters, first.Cols(column, G), rows, a[layer]);
  };
  CombineStreams(stream(head + 1, 0), stream(head + 2, G), y_rows);
}

void Network::ForwardPreferences(std::span<const Real> parameters, Matrix<const Real> x,
                                 RowRange rows, Activations& a, Matrix<Real> preferences) const {
  if (!shape_.dueling()) return Forward(parameters, x, rows, a, preferences);
  const Matrix<const Real> features = Trunk(parameters, x, rows, a);
  const int G = static_cast<int>(shape_.streams);
  const size_t head = num_hidden();
  const LayerView streams = layers_[head].View(parameters);
  const LayerView advantage = layers_[head + 2].View(parameters);
  const Matrix<Real> hidden = RowsOf(a[head].output, rows, 2 * G).Cols(G, G);
  LinearForward(features, streams.W.Cols(G, G), streams.b.subspan(shape_.streams), true, hidden);
  LinearForward(hidden, advantage.W, advantage.b, false, preferences.Rows(rows.first, rows.count));
}

void Network::TransposeWeights(int task, std::span<const Real> parameters,
                               std::span<Real> transposed) const {
  const auto& [layer, rows] = tasks_[task];
  layers_[layer].TransposeWeights(rows, parameters, transposed);
}

void Network::BackwardInputs(std::span<const Real> parameters, std::span<const Real> transposed,
                             Matrix<const Real> dy, RowRange rows, Activations& a,
                             Matrix<Real> dx) const {
  const auto backward = [&](size_t layer, GradientPlace input) {
    layers_[layer].Backward(parameters, transposed, rows, a[layer], input);
  };
  const auto gradient = [&](size_t layer) { return layers_[layer].OutputGradient(rows, a[layer]); };
  const Matrix<const Real> dy_rows = dy.Rows(rows.first, rows.count);
  const size_t head = num_hidden();
  if (shape_.dueling()) {
    const GradientPlace hidden = gradient(head);
    const int G = static_cast<int>(shape_.streams);
    const auto half = [&](int column) -> GradientPlace {
      return {hidden.dx.Cols(column, G), hidden.gate.Cols(column, G)};
    };
    CombineStreamsBackward(dy_rows, gradient(head + 1).dx, gradient(head + 2).dx);
    backward(head + 1, half(0));
    backward(head + 2, half(G));
  } else {
    std::ranges::copy(dy_rows.values(), gradient(head).dx.values().begin());
  }
  for (size_t layer = head; layer > 0; --layer) backward(layer, gradient(layer - 1));
  backward(0, {dx.empty() ? dx : dx.Rows(rows.first, rows.count)});
}

Real Network::BackwardWeights(int task, Matrix<const Real> x, const Activations& a,
                              std::span<Real> gradient) const {
  const auto& [layer, rows] = tasks_[task];
  const size_t head = num_hidden();
  Matrix<const Real> input = x;
  if (layer > head) {  // streams: value, then advantage
    const int G = static_cast<int>(shape_.streams);
    input = layers_[head].Output({0, x.rows()}, a[head]).Cols(layer == head + 1 ? 0 : G, G);
  } else if (layer > 0) {
    input = layers_[layer - 1].Output({0, x.rows()}, a[layer - 1]);
  }
  return layers_[layer].BackwardWeights(rows, input, a[layer], gradient);
}

void Network::Backward(std::span<const Real> parameters, Matrix<const Real> x, Activations& a,
                       Matrix<const Real> dy, std::span<Real> gradient, Matrix<Real> dx) const {
  AlignedVector<Real> transposed(num_parameters());
  for (int task = 0; task < num_tasks(); ++task) TransposeWeights(task, parameters, transposed);
  BackwardInputs(parameters, transposed, dy, {0, x.rows()}, a, dx);
  for (int task = 0; task < num_tasks(); ++task) BackwardWeights(task, x, a, gradient);
}

}  // namespace upswing
