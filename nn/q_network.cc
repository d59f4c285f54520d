#include "nn/q_network.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "nn/linear.h"

namespace upswing {
namespace {

/// Copies `cols` columns of x, from `first` on, into y (B × cols).
template <typename T>
void CopyColumns(Matrix<const T> x, int first, Matrix<T> y) {
  for (int i = 0; i < y.rows(); ++i) {
    std::copy_n(x.row(i).begin() + first, y.cols(), y.row(i).begin());
  }
}

/// Copies y (B × cols) into the columns of x from `first` on.
template <typename T>
void PasteColumns(Matrix<const T> y, int first, Matrix<T> x) {
  for (int i = 0; i < y.rows(); ++i) {
    std::copy_n(y.row(i).begin(), y.cols(), x.row(i).begin() + first);
  }
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
    const int out = static_cast<int>(shape_.hidden[i]);
    features_.push_back(AddLinear(name, out, width));
    width = out;
    if (shape_.layer_norm) {
      norms_.push_back(
          {AddBlock(name + ".norm.weight", 0, width), AddBlock(name + ".norm.bias", 0, width)});
    }
  }
  if (shape_.dueling) {
    const int head = static_cast<int>(shape_.head);
    streams_ = AddLinear("streams", 2 * head, width);
    value_ = AddLinear("value", 1, head);
    output_ = AddLinear("advantage", shape_.actions, head);
  } else {
    output_ = AddLinear("output", shape_.actions, width);
  }
}

template <typename T>
size_t QNetwork<T>::AddBlock(std::string name, int rows, int cols) {
  blocks_.push_back({std::move(name), num_parameters_, rows, cols});
  num_parameters_ += blocks_.back().size();
  return blocks_.size() - 1;
}

template <typename T>
typename QNetwork<T>::Linear QNetwork<T>::AddLinear(const std::string& name, int out, int in) {
  const size_t weight = AddBlock(name + ".weight", out, in);
  return {weight, AddBlock(name + ".bias", 0, out)};
}

template <typename T>
void QNetwork<T>::Initialize(Rng& rng, std::span<T> parameters) const {
  const auto fill = [&](const Linear& layer) {
    const double bound = 1.0 / std::sqrt(blocks_[layer.weight].cols);
    for (const size_t block : {layer.weight, layer.bias}) {
      for (T& p : parameters.subspan(blocks_[block].offset, blocks_[block].size())) {
        p = static_cast<T>(rng.Uniform(-bound, bound));
      }
    }
  };
  for (const Linear& layer : features_) fill(layer);
  if (shape_.dueling) {
    fill(streams_);
    fill(value_);
  }
  fill(output_);
  for (const Linear& norm : norms_) {
    const ParameterBlock& gain = blocks_[norm.weight];
    std::fill_n(parameters.begin() + static_cast<ptrdiff_t>(gain.offset), gain.size(), T{1});
    const ParameterBlock& bias = blocks_[norm.bias];
    std::fill_n(parameters.begin() + static_cast<ptrdiff_t>(bias.offset), bias.size(), T{0});
  }
}

template <typename T>
typename QNetwork<T>::Activations QNetwork<T>::MakeActivations(int max_batch) const {
  Activations a;
  a.max_batch = max_batch;
  const auto room = [&](int64_t width) {
    return AlignedVector<T>(static_cast<size_t>(max_batch) * static_cast<size_t>(width));
  };
  int64_t widest = 0;
  for (const int64_t width : shape_.hidden) {
    widest = std::max(widest, width);
    a.feature.push_back(room(width));
    if (shape_.layer_norm) {
      a.normal.push_back(room(width));
      a.inv_std.push_back(room(1));
    }
  }
  if (shape_.dueling) {
    a.streams = room(2 * shape_.head);
    a.value_in = room(shape_.head);
    a.advantage_in = room(shape_.head);
    a.value = room(1);
    a.grad_streams = room(2 * shape_.head);
    a.grad_head = room(shape_.head);
    a.grad_advantage = room(shape_.actions);
  }
  a.grad_a = room(widest);
  a.grad_b = room(widest);
  return a;
}

template <typename T>
Matrix<const T> QNetwork<T>::Weight(std::span<const T> parameters, const Linear& layer) const {
  const ParameterBlock& w = blocks_[layer.weight];
  return {parameters.data() + w.offset, w.rows, w.cols};
}

template <typename T>
std::span<const T> QNetwork<T>::Vector(std::span<const T> parameters, size_t block) const {
  return parameters.subspan(blocks_[block].offset, blocks_[block].size());
}

template <typename T>
void QNetwork<T>::Apply(std::span<const T> parameters, const Linear& layer, Matrix<const T> x,
                        Matrix<T> y) const {
  LinearForward(x, Weight(parameters, layer), Vector(parameters, layer.bias), y);
}

template <typename T>
void QNetwork<T>::ApplyBackward(std::span<const T> parameters, const Linear& layer,
                                Matrix<const T> x, Matrix<const T> dy, std::span<T> gradient,
                                Matrix<T> dx) const {
  const ParameterBlock& w = blocks_[layer.weight];
  const ParameterBlock& b = blocks_[layer.bias];
  const Matrix<T> dw(gradient.data() + w.offset, w.rows, w.cols);
  LinearBackward(x, Weight(parameters, layer), dy, dw, gradient.subspan(b.offset, b.size()), dx);
}

template <typename T>
void QNetwork<T>::Forward(std::span<const T> parameters, Matrix<const T> x, Activations& a,
                          Matrix<T> q) const {
  const int batch = x.rows();

  // Feature layers: linear, layer norm, ReLU.
  Matrix<const T> input = x;
  for (size_t i = 0; i < features_.size(); ++i) {
    const int width = static_cast<int>(shape_.hidden[i]);
    const Matrix<T> y(a.feature[i], batch, width);
    if (shape_.layer_norm) {
      const Matrix<T> normal(a.normal[i], batch, width);
      Apply(parameters, features_[i], input, normal);
      LayerNormForward(normal, Vector(parameters, norms_[i].weight),
                       Vector(parameters, norms_[i].bias), std::span(a.inv_std[i]), y);
    } else {
      Apply(parameters, features_[i], input, y);
    }
    ReluForward(y);
    input = y;
  }
  if (!shape_.dueling) return Apply(parameters, output_, input, q);

  // Value and advantage streams.
  const int head = static_cast<int>(shape_.head);
  const Matrix<T> streams(a.streams, batch, 2 * head);
  const Matrix<T> value_in(a.value_in, batch, head);
  const Matrix<T> advantage_in(a.advantage_in, batch, head);
  const Matrix<T> value(a.value, batch, 1);
  Apply(parameters, streams_, input, streams);
  ReluForward(streams);
  CopyColumns<T>(streams, 0, value_in);
  CopyColumns<T>(streams, head, advantage_in);
  Apply(parameters, value_, value_in, value);
  Apply(parameters, output_, advantage_in, q);
  CombineStreams<T>(value, q);
}

template <typename T>
void QNetwork<T>::BackwardStreams(std::span<const T> parameters, Matrix<const T> feature,
                                  Activations& a, Matrix<const T> dq, std::span<T> gradient,
                                  Matrix<T> dfeature) const {
  const int batch = dq.rows();
  const int head = static_cast<int>(shape_.head);
  const Matrix<T> streams(a.streams, batch, 2 * head);
  const Matrix<T> value_in(a.value_in, batch, head);
  const Matrix<T> advantage_in(a.advantage_in, batch, head);
  const Matrix<T> dvalue(a.value, batch, 1);  // V itself is no longer needed
  const Matrix<T> dadvantage(a.grad_advantage, batch, shape_.actions);
  const Matrix<T> dhead(a.grad_head, batch, head);
  const Matrix<T> dstreams(a.grad_streams, batch, 2 * head);
  CombineStreamsBackward(dq, dvalue, dadvantage);
  ApplyBackward(parameters, value_, value_in, dvalue, gradient, dhead);
  PasteColumns<T>(dhead, 0, dstreams);
  ApplyBackward(parameters, output_, advantage_in, dadvantage, gradient, dhead);
  PasteColumns<T>(dhead, head, dstreams);
  ReluBackward<T>(streams, dstreams);
  ApplyBackward(parameters, streams_, feature, dstreams, gradient, dfeature);
}

template <typename T>
void QNetwork<T>::Backward(std::span<const T> parameters, Matrix<const T> x, Activations& a,
                           Matrix<const T> dq, std::span<T> gradient) const {
  const int batch = x.rows();
  const size_t last = features_.size() - 1;
  const auto width = [&](size_t i) { return static_cast<int>(shape_.hidden[i]); };
  const auto feature = [&](size_t i) -> Matrix<const T> {
    return Matrix<T>(a.feature[i], batch, width(i));
  };

  // dy: gradient of feature layer i's output.
  Matrix<T> dy(a.grad_a, batch, width(last));
  if (shape_.dueling) {
    BackwardStreams(parameters, feature(last), a, dq, gradient, dy);
  } else {
    ApplyBackward(parameters, output_, feature(last), dq, gradient, dy);
  }

  // Feature layers from last to first: ReLU, layer norm, linear.
  for (size_t i = last + 1; i-- > 0;) {
    ReluBackward(feature(i), dy);
    if (shape_.layer_norm) {
      const ParameterBlock& gain = blocks_[norms_[i].weight];
      const ParameterBlock& bias = blocks_[norms_[i].bias];
      const Matrix<T> normal(a.normal[i], batch, width(i));
      LayerNormBackward<T>(normal, Vector(parameters, norms_[i].weight), a.inv_std[i],
                           gradient.subspan(gain.offset, gain.size()),
                           gradient.subspan(bias.offset, bias.size()), dy);
    }
    Matrix<T> dx;  // the observation's gradient is not wanted
    if (i > 0)
      dx = Matrix<T>(dy.data() == a.grad_a.data() ? a.grad_b : a.grad_a, batch, width(i - 1));
    ApplyBackward(parameters, features_[i], i > 0 ? feature(i - 1) : x, dy, gradient, dx);
    dy = dx;
  }
}

template class QNetwork<float>;
template class QNetwork<double>;

}  // namespace upswing
