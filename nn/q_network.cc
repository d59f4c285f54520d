#include "nn/q_network.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "core/error.h"
#include "core/text.h"
#include "nn/bfloat16.h"
#include "nn/linear.h"

namespace upswing {
namespace {

constexpr int kTaskRows = 64;  // of a weight matrix
static_assert(kTaskRows % 2 == 0, "tasks do not share pairs of rows");

/// The numbers of some rows in an array that has one for each row.
template <typename T>
std::span<T> PartOf(std::span<T> values, RowRange rows) {
  return values.subspan(static_cast<size_t>(rows.first), static_cast<size_t>(rows.count));
}

/// A batch's matrix (… × cols) in `values`, or the given rows of it.
template <typename T>
Matrix<T> RowsOf(AlignedVector<T>& values, RowRange rows, int cols) {
  return Matrix<T>(values, rows.first + rows.count, cols).Rows(rows.first, rows.count);
}
template <typename T>
Matrix<const T> AllRows(const AlignedVector<T>& values, int rows, int cols) {
  return {std::span<const T>(values), rows, cols};
}

/// q = V + A - mean(A) (Wang et al., 2016, Eq 9), in place on the advantages q (B × A).
template <typename T>
void CombineStreams(Matrix<const T> value, Matrix<T> q) {
  for (int i = 0; i < q.rows(); ++i) {
    T mean = 0;
    for (const T advantage : q.row(i)) mean += advantage;
    mean /= static_cast<T>(q.cols());
    for (T& advantage : q.row(i)) advantage += value(i, 0) - mean;
  }
}

/// Backward pass of CombineStreams: dV = sum(dq), dA = dq - mean(dq).
template <typename T>
void CombineStreamsBackward(Matrix<const T> dq, Matrix<T> dvalue, Matrix<T> dadvantage) {
  for (int i = 0; i < dq.rows(); ++i) {
    T sum = 0;
    for (const T g : dq.row(i)) sum += g;
    dvalue(i, 0) = sum;
    for (int a = 0; a < dq.cols(); ++a) {
      dadvantage(i, a) = dq(i, a) - sum / static_cast<T>(dq.cols());
    }
  }
}

}  // namespace

template <typename T>
QNetwork<T>::QNetwork(QNetworkShape shape, bool bfloat16)
    : shape_(std::move(shape)), bfloat16_(bfloat16) {
  if (bfloat16_ && (!std::is_same_v<T, float> || Bfloat16Paths().empty())) {
    throw BadInput(
        "bfloat16 products: this processor has no instructions for them (AVX512_BF16); expected "
        "precision float32");
  }
  // Settings and policy files both end here, so the sizes are checked here.
  constexpr int64_t kMaxWidth = QNetworkShape::kMaxWidth;
  constexpr size_t kMaxLayers = QNetworkShape::kMaxLayers;
  const auto valid = [](int64_t n) { return n >= 1 && n <= kMaxWidth; };
  const bool sizes_valid = valid(shape_.inputs) && valid(shape_.actions) &&
                           !shape_.hidden.empty() && shape_.hidden.size() <= kMaxLayers &&
                           std::all_of(shape_.hidden.begin(), shape_.hidden.end(), valid) &&
                           (shape_.dueling ? valid(shape_.head) : shape_.head == 0);
  if (!sizes_valid) {
    throw BadInput(Concat("network: expected 1 to ", kMaxLayers, " layers of 1 to ", kMaxWidth,
                          " units, got inputs ", shape_.inputs, ", actions ", shape_.actions, ", ",
                          shape_.hidden.size(), " hidden layers, head ", shape_.head));
  }

  int width = shape_.inputs;
  for (size_t i = 0; i < shape_.hidden.size(); ++i) {
    const std::string name = Concat("feature.", i);
    AddLayer(name, width, static_cast<int>(shape_.hidden[i]));
    width = static_cast<int>(shape_.hidden[i]);
    if (shape_.layer_norm) {
      norms_.push_back(
          {AddBlock(name + ".norm.weight", 0, width), AddBlock(name + ".norm.bias", 0, width)});
    }
  }
  if (shape_.dueling) {
    const int head = static_cast<int>(shape_.head);
    AddLayer("streams", width, 2 * head);
    AddLayer("value", head, 1);
    AddLayer("advantage", head, shape_.actions);
  } else {
    AddLayer("output", width, shape_.actions);
  }
  AddTasks();
}

template <typename T>
size_t QNetwork<T>::AddBlock(std::string name, int in, int out) {
  blocks_.push_back({std::move(name), num_parameters_, in, out});
  num_parameters_ += blocks_.back().size();
  return blocks_.size() - 1;
}

template <typename T>
void QNetwork<T>::AddLayer(const std::string& name, int in, int out) {
  const size_t weight = AddBlock(name + ".weight", in, out);
  layers_.push_back({weight, AddBlock(name + ".bias", 0, out)});
}

template <typename T>
void QNetwork<T>::AddTasks() {
  for (size_t layer = 0; layer < layers_.size(); ++layer) {
    const int in = blocks_[layers_[layer].weight].in;
    for (int first = 0; first < in; first += kTaskRows) {
      tasks_.push_back({layer, {first, std::min(kTaskRows, in - first)}});
    }
  }
}

template <typename T>
void QNetwork<T>::Initialize(Rng& rng, std::span<T> parameters) const {
  for (const Layer& layer : layers_) {
    const double bound = 1.0 / std::sqrt(blocks_[layer.weight].in);
    for (const size_t block : {layer.weight, layer.bias}) {
      for (T& p : parameters.subspan(blocks_[block].offset, blocks_[block].size())) {
        p = static_cast<T>(rng.Uniform(-bound, bound));
      }
    }
  }
  for (const Layer& norm : norms_) {
    const ParameterBlock& gain = blocks_[norm.weight];
    std::fill_n(parameters.begin() + static_cast<ptrdiff_t>(gain.offset), gain.size(), T{1});
    const ParameterBlock& bias = blocks_[norm.bias];
    std::fill_n(parameters.begin() + static_cast<ptrdiff_t>(bias.offset), bias.size(), T{0});
  }
}

template <typename T>
typename QNetwork<T>::Activations QNetwork<T>::MakeActivations(int max_batch,
                                                               bool gradients) const {
  Activations a;
  const auto room = [&](int64_t width) {
    return AlignedVector<T>(static_cast<size_t>(max_batch) * static_cast<size_t>(width));
  };
  for (const int64_t width : shape_.hidden) {
    a.feature.push_back(room(width));
    if (gradients) a.grad_feature.push_back(room(width));
    if (!shape_.layer_norm) continue;
    a.normal.push_back(room(width));
    a.inv_std.push_back(room(1));
    if (gradients) a.grad_normal.push_back(room(width));
  }
  if (shape_.dueling) {
    a.streams = room(2 * shape_.head);
    a.value = room(1);
    if (gradients) a.grad_streams = room(2 * shape_.head);
    if (gradients) a.grad_value = room(1);
  }
  if (gradients) a.grad_output = room(shape_.actions);
  return a;
}

template <typename T>
Matrix<const T> QNetwork<T>::Weight(std::span<const T> parameters, const Layer& layer) const {
  const ParameterBlock& w = blocks_[layer.weight];
  return {parameters.data() + w.offset, w.in, w.out};
}

template <typename T>
std::span<const T> QNetwork<T>::Vector(std::span<const T> parameters, size_t block) const {
  return parameters.subspan(blocks_[block].offset, blocks_[block].size());
}

template <typename T>
typename QNetwork<T>::Prepared QNetwork<T>::MakePrepared(bool backward) const {
  Prepared prepared;
  if (backward) prepared.transposed.resize(num_parameters_);
  if (bfloat16_) prepared.pairs.resize(num_parameters_);
  if (bfloat16_ && backward) prepared.transposed_pairs.resize(num_parameters_);
  return prepared;
}

template <typename T>
void QNetwork<T>::Prepare(int task, std::span<const T> parameters, Prepared& prepared) const {
  const Task& t = tasks_[static_cast<size_t>(task)];
  const ParameterBlock& block = blocks_[layers_[t.layer].weight];
  const int first = t.rows.first;
  const int count = t.rows.count;
  const Matrix<const T> rows = Weight(parameters, layers_[t.layer]).Rows(first, count);
  Matrix<T> columns;
  if (!prepared.transposed.empty()) {
    const Matrix<T> all(prepared.transposed.data() + block.offset, block.out, block.in);
    columns = all.Cols(first, count);
    Transpose(rows, columns);
  }
  if constexpr (std::is_same_v<T, float>) {
    if (!prepared.pairs.empty()) {
      const Matrix<uint32_t> pairs(prepared.pairs.data() + block.offset, PairsIn(block.in),
                                   block.out);
      PackPairs(rows, pairs.Rows(first / 2, PairsIn(count)));
    }
    if (!prepared.transposed_pairs.empty()) {
      const Matrix<uint32_t> pairs(prepared.transposed_pairs.data() + block.offset,
                                   PairsIn(block.out), block.in);
      PackPairs(columns, pairs.Cols(first, count));
    }
  }
}

template <typename T>
void QNetwork<T>::Apply(Weights weights, const Layer& layer, Matrix<const T> x, bool relu,
                        Matrix<T> y) const {
  const ParameterBlock& w = blocks_[layer.weight];
  const std::span<const T> b = Vector(weights.parameters, layer.bias);
  if constexpr (std::is_same_v<T, float>) {
    if (bfloat16_ && weights.prepared != nullptr) {
      const uint32_t* pairs = weights.prepared->pairs.data() + w.offset;
      return LinearForwardBfloat16(x, Matrix<const uint32_t>(pairs, PairsIn(w.in), w.out), b, relu,
                                   y);
    }
  }
  LinearForward(x, Weight(weights.parameters, layer), b, relu, y);
}

template <typename T>
void QNetwork<T>::ApplyBackward(Weights weights, const Layer& layer, Matrix<const T> dy,
                                Matrix<const T> gate, Matrix<T> dx) const {
  const ParameterBlock& w = blocks_[layer.weight];
  if constexpr (std::is_same_v<T, float>) {
    if (bfloat16_) {
      const uint32_t* pairs = weights.prepared->transposed_pairs.data() + w.offset;
      return LinearBackwardInputBfloat16(dy, Matrix<const uint32_t>(pairs, PairsIn(w.out), w.in),
                                         gate, dx);
    }
  }
  const T* transposed = weights.prepared->transposed.data() + w.offset;
  LinearBackwardInput(dy, Matrix<const T>(transposed, w.out, w.in), gate, dx);
}

template <typename T>
Matrix<const T> QNetwork<T>::ForwardFeatures(Weights weights, Matrix<const T> x, RowRange rows,
                                             Activations& a) const {
  // Linear, layer norm, ReLU.
  Matrix<const T> input = x.Rows(rows.first, rows.count);
  for (size_t i = 0; i < num_features(); ++i) {
    const auto width = static_cast<int>(shape_.hidden[i]);
    const Matrix<T> y = RowsOf(a.feature[i], rows, width);
    if (shape_.layer_norm) {
      const Matrix<T> normal = RowsOf(a.normal[i], rows, width);
      Apply(weights, layers_[i], input, false, normal);
      LayerNormForward(normal, Vector(weights.parameters, norms_[i].weight),
                       Vector(weights.parameters, norms_[i].bias),
                       PartOf(std::span(a.inv_std[i]), rows), true, y);
    } else {
      Apply(weights, layers_[i], input, true, y);
    }
    input = y;
  }
  return input;
}

template <typename T>
void QNetwork<T>::Forward(Weights weights, Matrix<const T> x, RowRange rows, Activations& a,
                          Matrix<T> q) const {
  const Matrix<const T> feature = ForwardFeatures(weights, x, rows, a);
  const Matrix<T> q_rows = q.Rows(rows.first, rows.count);
  if (!shape_.dueling) return Apply(weights, output(), feature, false, q_rows);

  const int head = static_cast<int>(shape_.head);
  const Matrix<T> hidden = RowsOf(a.streams, rows, 2 * head);
  const Matrix<T> v = RowsOf(a.value, rows, 1);
  Apply(weights, streams(), feature, true, hidden);
  Apply(weights, value(), hidden.Cols(0, head), false, v);
  Apply(weights, output(), hidden.Cols(head, head), false, q_rows);
  CombineStreams<T>(v, q_rows);
}

template <typename T>
void QNetwork<T>::ForwardPreferences(std::span<const T> parameters, Matrix<const T> x,
                                     RowRange rows, Activations& a, Matrix<T> preferences) const {
  const Weights weights{parameters};
  if (!shape_.dueling) return Forward(weights, x, rows, a, preferences);
  const Matrix<const T> feature = ForwardFeatures(weights, x, rows, a);
  const int head = static_cast<int>(shape_.head);
  const Matrix<T> hidden = RowsOf(a.streams, rows, 2 * head).Cols(head, head);
  const Matrix<const T> w = Weight(parameters, streams()).Cols(head, head);
  const auto b = Vector(parameters, streams().bias).subspan(static_cast<size_t>(head));
  LinearForward(feature, w, b, true, hidden);
  Apply(weights, output(), hidden, false, preferences.Rows(rows.first, rows.count));
}

template <typename T>
void QNetwork<T>::BackwardStreams(Weights weights, Matrix<const T> dq, RowRange rows,
                                  Activations& a) const {
  const int head = static_cast<int>(shape_.head);
  const Matrix<const T> hidden = RowsOf(a.streams, rows, 2 * head);
  const Matrix<T> dhidden = RowsOf(a.grad_streams, rows, 2 * head);
  const Matrix<T> dvalue = RowsOf(a.grad_value, rows, 1);
  const Matrix<T> dadvantage = RowsOf(a.grad_output, rows, shape_.actions);
  CombineStreamsBackward(dq, dvalue, dadvantage);
  ApplyBackward(weights, value(), dvalue, hidden.Cols(0, head), dhidden.Cols(0, head));
  ApplyBackward(weights, output(), dadvantage, hidden.Cols(head, head), dhidden.Cols(head, head));
}

template <typename T>
void QNetwork<T>::BackwardInputs(Weights weights, Matrix<const T> dq, RowRange rows,
                                 Activations& a) const {
  // dy: gradient of the output of the layer above feature layer i.
  const Matrix<const T> dq_rows = dq.Rows(rows.first, rows.count);
  Matrix<const T> dy;
  const Layer* above = &layers_[num_features()];
  if (shape_.dueling) {
    BackwardStreams(weights, dq_rows, rows, a);
    dy = RowsOf(a.grad_streams, rows, 2 * static_cast<int>(shape_.head));
  } else {
    const Matrix<T> doutput = RowsOf(a.grad_output, rows, shape_.actions);
    std::ranges::copy(dq_rows.values(), doutput.values().begin());
    dy = doutput;
  }

  for (size_t i = num_features(); i-- > 0;) {
    const auto width = static_cast<int>(shape_.hidden[i]);
    const Matrix<T> dx = RowsOf(a.grad_feature[i], rows, width);
    const Matrix<T> dnormal = shape_.layer_norm ? RowsOf(a.grad_normal[i], rows, width) : dx;
    ApplyBackward(weights, *above, dy, RowsOf(a.feature[i], rows, width), dnormal);
    if (shape_.layer_norm) {
      LayerNormBackwardInput<T>(RowsOf(a.normal[i], rows, width),
                                Vector(weights.parameters, norms_[i].weight),
                                PartOf(std::span<const T>(a.inv_std[i]), rows), dnormal, dx);
    }
    dy = dx;
    above = &layers_[i];
  }
}

template <typename T>
Matrix<const T> QNetwork<T>::LayerInput(size_t layer, Matrix<const T> x,
                                        const Activations& a) const {
  if (layer == 0) return x;
  const int head = static_cast<int>(shape_.head);
  if (layer <= num_features()) {
    return AllRows(a.feature[layer - 1], x.rows(), static_cast<int>(shape_.hidden[layer - 1]));
  }
  const bool advantage = layer == layers_.size() - 1;
  return AllRows(a.streams, x.rows(), 2 * head).Cols(advantage ? head : 0, head);
}

template <typename T>
Matrix<const T> QNetwork<T>::LayerGradient(size_t layer, int batch, const Activations& a) const {
  const int out = blocks_[layers_[layer].weight].out;
  if (layer < num_features()) return AllRows(a.grad_feature[layer], batch, out);
  if (layer == layers_.size() - 1) return AllRows(a.grad_output, batch, out);
  return AllRows(layer == num_features() ? a.grad_streams : a.grad_value, batch, out);
}

template <typename T>
T QNetwork<T>::BackwardWeights(int task, Matrix<const T> x, const Activations& a,
                               std::span<T> gradient) const {
  const Task& t = tasks_[static_cast<size_t>(task)];
  const Layer& layer = layers_[t.layer];
  const Matrix<const T> dy = LayerGradient(t.layer, x.rows(), a);
  const auto part = [&](size_t block) {
    return gradient.subspan(blocks_[block].offset, blocks_[block].size());
  };

  const ParameterBlock& w = blocks_[layer.weight];
  const Matrix<T> dw = Matrix<T>(part(layer.weight), w.in, w.out).Rows(t.rows.first, t.rows.count);
  const Matrix<const T> input = LayerInput(t.layer, x, a).Cols(t.rows.first, t.rows.count);
  if constexpr (std::is_same_v<T, float>) {
    bfloat16_ ? LinearBackwardWeightBfloat16(input, dy, dw) : LinearBackwardWeight(input, dy, dw);
  } else {
    LinearBackwardWeight(input, dy, dw);
  }
  T squares = SquaredNorm<T>(dw.values());
  if (t.rows.first > 0) return squares;

  SumRows(dy, part(layer.bias));
  squares += SquaredNorm<T>(part(layer.bias));
  if (t.layer < norms_.size()) {
    const Layer& norm = norms_[t.layer];
    const Matrix<const T> dnormal = AllRows(a.grad_normal[t.layer], x.rows(), w.out);
    LayerNormBackwardGain(AllRows(a.normal[t.layer], x.rows(), w.out), dnormal, part(norm.weight));
    SumRows(dnormal, part(norm.bias));
    squares += SquaredNorm<T>(part(norm.weight)) + SquaredNorm<T>(part(norm.bias));
  }
  return squares;
}

template <typename T>
void QNetwork<T>::Backward(std::span<const T> parameters, Matrix<const T> x, Activations& a,
                           Matrix<const T> dq, std::span<T> gradient) const {
  Prepared prepared = MakePrepared(true);
  for (int task = 0; task < num_tasks(); ++task) Prepare(task, parameters, prepared);
  BackwardInputs({parameters, &prepared}, dq, {0, x.rows()}, a);
  for (int task = 0; task < num_tasks(); ++task) BackwardWeights(task, x, a, gradient);
}

template class QNetwork<float>;
template class QNetwork<double>;

}  // namespace upswing
