#include "nn/network.h"

#include <algorithm>
#include <variant>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

/// Throws BadInput on invalid sizes. Settings and policy files both end here.
void CheckSizes(const MlpShape& trunk, const HeadShape& head) {
  constexpr int64_t kMax = MlpShape::kMaxWidth;
  const auto valid = [](int64_t n) { return n >= 1 && n <= kMax; };
  if (valid(trunk.inputs) && valid(head.outputs) && !trunk.hidden.empty() &&
      trunk.hidden.size() <= MlpShape::kMaxLayers && std::ranges::all_of(trunk.hidden, valid) &&
      (head.streams == 0 || valid(head.streams))) {
    return;
  }
  std::vector<std::string> widths;
  for (const int64_t width : trunk.hidden) widths.push_back(std::to_string(width));
  throw BadInput(Concat("network: expected 1 to ", MlpShape::kMaxLayers, " layers of 1 to ", kMax,
                        " units, got inputs ", trunk.inputs, ", outputs ", head.outputs, ", ",
                        trunk.hidden.size(), " hidden layers (", Join(widths, ", "), "), head ",
                        head.streams));
}

/// The layout of a network that has no layers yet. Throws BadInput as Network does.
template <typename T>
ParameterLayout<T> EmptyLayout(const MlpShape& trunk, const HeadShape& head) {
  CheckSizes(trunk, head);
  return {};
}

template <typename T>
Head<T> MakeHead(int features, const HeadShape& shape, ParameterLayout<T>& layout) {
  if (shape.streams == 0) return LinearHead<T>(features, shape, layout);
  return DuelingHead<T>(features, shape, layout);
}

}  // namespace

template <typename T>
Network<T>::Network(const MlpShape& trunk, const HeadShape& head)
    : layout_(EmptyLayout<T>(trunk, head)),
      trunk_(trunk, layout_),
      head_(MakeHead(trunk_.width(), head, layout_)) {}

template <typename T>
void Network<T>::Initialize(Rng& rng, std::span<T> parameters) const {
  for (const Layer<T>& layer : layout_.layers) layer.Initialize(rng, parameters);
}

template <typename T>
typename Network<T>::Activations Network<T>::MakeActivations(int max_batch, bool gradients) const {
  Activations a;
  for (const Layer<T>& layer : layout_.layers) {
    auto& part = a.trunk.size() < trunk_.num_layers() ? a.trunk : a.head;
    part.push_back(layer.MakeActivations(max_batch, gradients));
  }
  return a;
}

template <typename T>
Prepared<T> Network<T>::MakePrepared() const {
  return {AlignedVector<T>(layout_.size)};
}

template <typename T>
void Network<T>::Prepare(int task, std::span<const T> parameters, Prepared& prepared) const {
  const auto& t = layout_.tasks[static_cast<size_t>(task)];
  layout_.layers[t.layer].Prepare(t.rows, parameters, prepared);
}

template <typename T>
void Network<T>::Forward(Weights weights, Matrix<const T> x, RowRange rows, Activations& a,
                         Matrix<T> y) const {
  const Matrix<const T> features = trunk_.Forward(weights, x, rows, a.trunk);
  const Matrix<T> y_rows = y.Rows(rows.first, rows.count);
  std::visit([&](const auto& head) { head.Forward(weights, features, rows, a.head, y_rows); },
             head_);
}

template <typename T>
void Network<T>::ForwardPreferences(std::span<const T> parameters, Matrix<const T> x, RowRange rows,
                                    Activations& a, Matrix<T> preferences) const {
  const auto* dueling = std::get_if<DuelingHead<T>>(&head_);
  if (dueling == nullptr) return Forward({parameters}, x, rows, a, preferences);
  const Matrix<const T> features = trunk_.Forward({parameters}, x, rows, a.trunk);
  dueling->ForwardAdvantages(parameters, features, rows, a.head,
                             preferences.Rows(rows.first, rows.count));
}

template <typename T>
void Network<T>::BackwardInputs(Weights weights, Matrix<const T> dy, RowRange rows, Activations& a,
                                Matrix<T> dx) const {
  const Matrix<const T> dy_rows = dy.Rows(rows.first, rows.count);
  const GradientPlace<T> dfeatures = trunk_.FeatureGradient(rows, a.trunk);
  std::visit([&](const auto& head) { head.Backward(weights, dy_rows, rows, a.head, dfeatures); },
             head_);
  trunk_.Backward(weights, rows, a.trunk, dx);
}

template <typename T>
T Network<T>::BackwardWeights(int task, Matrix<const T> x, const Activations& a,
                              std::span<T> gradient) const {
  const auto& t = layout_.tasks[static_cast<size_t>(task)];
  const size_t below = trunk_.num_layers();
  if (t.layer < below) return trunk_.BackwardWeights(t.layer, t.rows, x, a.trunk, gradient);
  const Matrix<const T> features = trunk_.Features({0, x.rows()}, a.trunk);
  const auto of_head = [&](const auto& head) {
    return head.BackwardWeights(t.layer - below, t.rows, features, a.head, gradient);
  };
  return std::visit(of_head, head_);
}

template <typename T>
void Network<T>::Backward(std::span<const T> parameters, Matrix<const T> x, Activations& a,
                          Matrix<const T> dy, std::span<T> gradient, Matrix<T> dx) const {
  Prepared prepared = MakePrepared();
  for (int task = 0; task < num_tasks(); ++task) Prepare(task, parameters, prepared);
  BackwardInputs({parameters, &prepared}, dy, {0, x.rows()}, a, dx);
  for (int task = 0; task < num_tasks(); ++task) BackwardWeights(task, x, a, gradient);
}

template class Network<float>;
template class Network<double>;

}  // namespace upswing
