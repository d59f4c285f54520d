#include "nn/q_network.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "nn/linear.h"

namespace upswing {
namespace {

constexpr int kTaskRows = 32;  // of a weight matrix

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

/// The way back of CombineStreams: dV = sum(dq), dA = dq - mean(dq).
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
QNetwork<T>::QNetwork(QNetworkShape shape) : shape_(std::move(shape)) {
  // A policy file brings these numbers too, so they are checked here, where both ways meet.
  constexpr int64_t kMaxWidth = 4096;
  const auto valid = [](int64_t n) { return n >= 1 && n <= kMaxWidth; };
  const bool sizes_valid = valid(shape_.inputs) && valid(shape_.actions) &&
                           !shape_.hidden.empty() && shape_.hidden.size() <= 16 &&
                           std::all_of(shape_.hidden.begin(), shape_.hidden.end(), valid) &&
                           (shape_.dueling ? valid(shape_.head) : shape_.head == 0);
  if (!sizes_valid) {
    throw BadInput(Concat("network: expected 1 to 16 layers of 1 to ", kMaxWidth,
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
Matrix<const T> QNetwork<T>::Transposed(std::span<const T> transposed, const Layer& layer) const {
  const ParameterBlock& w = blocks_[layer.weight];
  return {transposed.data() + w.offset, w.out, w.in};
}

template <typename T>
std::span<const T> QNetwork<T>::Vector(std::span<const T> parameters, size_t block) const {
  return parameters.subspan(blocks_[block].offset, blocks_[block].size());
}

template <typename T>
Matrix<const T> QNetwork<T>::ForwardFeatures(std::span<const T> parameters, Matrix<const T> x,
                                             RowRange rows, Activations& a) const {
  // Linear, layer norm, ReLU.
  Matrix<const T> input = x.Rows(rows.first, rows.count);
  for (size_t i = 0; i < num_features(); ++i) {
    const auto width = static_cast<int>(shape_.hidden[i]);
    const Matrix<const T> w = Weight(parameters, layers_[i]);
    const std::span<const T> b = Vector(parameters, layers_[i].bias);
    const Matrix<T> y = RowsOf(a.feature[i], rows, width);
    if (shape_.layer_norm) {
      const Matrix<T> normal = RowsOf(a.normal[i], rows, width);
      LinearForward(input, w, b, false, normal);
      LayerNormReluForward(
          normal, Vector(parameters, norms_[i].weight), Vector(parameters, norms_[i].bias),
          std::span(a.inv_std[i])
              .subspan(static_cast<size_t>(rows.first), static_cast<size_t>(rows.count)),
          y);
    } else {
      LinearForward(input, w, b, true, y);
    }
    input = y;
  }
  return input;
}

template <typename T>
void QNetwork<T>::Forward(std::span<const T> parameters, Matrix<const T> x, RowRange rows,
                          Activations& a, Matrix<T> q) const {
  const Matrix<const T> feature = ForwardFeatures(parameters, x, rows, a);
  const Matrix<T> q_rows = q.Rows(rows.first, rows.count);
  const auto apply = [&](const Layer& layer, Matrix<const T> input, bool relu, Matrix<T> y) {
    LinearForward(input, Weight(parameters, layer), Vector(parameters, layer.bias), relu, y);
  };
  if (!shape_.dueling) return apply(output(), feature, false, q_rows);

  const int head = static_cast<int>(shape_.head);
  const Matrix<T> hidden = RowsOf(a.streams, rows, 2 * head);
  const Matrix<T> v = RowsOf(a.value, rows, 1);
  apply(streams(), feature, true, hidden);
  apply(value(), hidden.Cols(0, head), false, v);
  apply(output(), hidden.Cols(head, head), false, q_rows);
  CombineStreams<T>(v, q_rows);
}

template <typename T>
void QNetwork<T>::ForwardPreferences(std::span<const T> parameters, Matrix<const T> x,
                                     RowRange rows, Activations& a, Matrix<T> preferences) const {
  if (!shape_.dueling) return Forward(parameters, x, rows, a, preferences);
  const Matrix<const T> feature = ForwardFeatures(parameters, x, rows, a);
  const int head = static_cast<int>(shape_.head);
  const Matrix<T> hidden = RowsOf(a.streams, rows, 2 * head).Cols(head, head);
  LinearForward(feature, Weight(parameters, streams()).Cols(head, head),
                Vector(parameters, streams().bias).subspan(static_cast<size_t>(head)), true,
                hidden);
  LinearForward<T>(hidden, Weight(parameters, output()), Vector(parameters, output().bias), false,
                   preferences.Rows(rows.first, rows.count));
}

template <typename T>
void QNetwork<T>::TransposeWeights(int task, std::span<const T> parameters,
                                   std::span<T> transposed) const {
  const Task& t = tasks_[static_cast<size_t>(task)];
  const ParameterBlock& w = blocks_[layers_[t.layer].weight];
  const Matrix<T> target(transposed.data() + w.offset, w.out, w.in);
  Transpose(Weight(parameters, layers_[t.layer]).Rows(t.rows.first, t.rows.count),
            target.Cols(t.rows.first, t.rows.count));
}

template <typename T>
void QNetwork<T>::BackwardStreams(std::span<const T> transposed, Matrix<const T> dq, RowRange rows,
                                  Activations& a) const {
  const int head = static_cast<int>(shape_.head);
  const Matrix<const T> hidden = RowsOf(a.streams, rows, 2 * head);
  const Matrix<T> dhidden = RowsOf(a.grad_streams, rows, 2 * head);
  const Matrix<T> dvalue = RowsOf(a.grad_value, rows, 1);
  const Matrix<T> dadvantage = RowsOf(a.grad_output, rows, shape_.actions);
  CombineStreamsBackward(dq, dvalue, dadvantage);
  LinearBackwardInput<T>(dvalue, Transposed(transposed, value()), hidden.Cols(0, head),
                         dhidden.Cols(0, head));
  LinearBackwardInput<T>(dadvantage, Transposed(transposed, output()), hidden.Cols(head, head),
                         dhidden.Cols(head, head));
}

template <typename T>
void QNetwork<T>::BackwardInputs(std::span<const T> parameters, std::span<const T> transposed,
                                 Matrix<const T> dq, RowRange rows, Activations& a) const {
  // dy: gradient of the input of the layer above feature layer i, whose transposed weight is w.
  const size_t last = num_features() - 1;
  Matrix<const T> dy;
  const Layer* above = nullptr;
  if (shape_.dueling) {
    BackwardStreams(transposed, dq.Rows(rows.first, rows.count), rows, a);
    dy = RowsOf(a.grad_streams, rows, 2 * static_cast<int>(shape_.head));
    above = &streams();
  } else {
    const Matrix<T> doutput = RowsOf(a.grad_output, rows, shape_.actions);
    std::ranges::copy(dq.Rows(rows.first, rows.count).values(), doutput.values().begin());
    dy = doutput;
    above = &output();
  }

  for (size_t i = last + 1; i-- > 0;) {
    const auto width = static_cast<int>(shape_.hidden[i]);
    const Matrix<T> dx = RowsOf(a.grad_feature[i], rows, width);
    const Matrix<T> dnormal = shape_.layer_norm ? RowsOf(a.grad_normal[i], rows, width) : dx;
    LinearBackwardInput<T>(dy, Transposed(transposed, *above), RowsOf(a.feature[i], rows, width),
                           dnormal);
    if (shape_.layer_norm) {
      LayerNormBackwardInput<T>(
          RowsOf(a.normal[i], rows, width), Vector(parameters, norms_[i].weight),
          std::span<const T>(a.inv_std[i])
              .subspan(static_cast<size_t>(rows.first), static_cast<size_t>(rows.count)),
          dnormal, dx);
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
  LinearBackwardWeight(LayerInput(t.layer, x, a).Cols(t.rows.first, t.rows.count), dy, dw);
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
  AlignedVector<T> transposed(num_parameters_);
  for (int task = 0; task < num_tasks(); ++task) TransposeWeights(task, parameters, transposed);
  BackwardInputs(parameters, transposed, dq, {0, x.rows()}, a);
  for (int task = 0; task < num_tasks(); ++task) BackwardWeights(task, x, a, gradient);
}

template class QNetwork<float>;
template class QNetwork<double>;

}  // namespace upswing
