#include "nn/heads.h"

#include "nn/linear.h"

namespace upswing {
namespace {

enum : size_t { kStreams, kValue, kAdvantage };  // the layers of a dueling head

/// y = V + A - mean(A) (Wang et al., 2016, Eq 9).
template <typename T>
void CombineStreams(Matrix<const T> value, Matrix<const T> advantage, Matrix<T> y) {
  for (int i = 0; i < y.rows(); ++i) {
    T mean = 0;
    for (const T A : advantage.row(i)) mean += A;
    mean /= static_cast<T>(y.cols());
    for (int k = 0; k < y.cols(); ++k) y(i, k) = advantage(i, k) + (value(i, 0) - mean);
  }
}

/// Backward pass of CombineStreams: dV = sum(dy), dA = dy - mean(dy).
template <typename T>
void CombineStreamsBackward(Matrix<const T> dy, Matrix<T> dvalue, Matrix<T> dadvantage) {
  for (int i = 0; i < dy.rows(); ++i) {
    T sum = 0;
    for (const T g : dy.row(i)) sum += g;
    dvalue(i, 0) = sum;
    for (int k = 0; k < dy.cols(); ++k) {
      dadvantage(i, k) = dy(i, k) - sum / static_cast<T>(dy.cols());
    }
  }
}

}  // namespace

template <typename T>
DuelingHead<T>::DuelingHead(int features, const HeadShape& shape, ParameterLayout<T>& layout)
    : width_(static_cast<int>(shape.streams)),
      streams_(layout.Add("streams", {features, 2 * width_, Activation::kRelu})),
      value_(layout.Add("value", {width_, 1})),
      advantage_(layout.Add("advantage", {width_, shape.outputs})) {}

template <typename T>
void DuelingHead<T>::Forward(Weights<T> weights, Matrix<const T> x, RowRange rows, Activations& a,
                             Matrix<T> y) const {
  const Matrix<const T> hidden = streams_.Forward(weights, x, rows, a[kStreams]);
  CombineStreams(value_.Forward(weights, hidden.Cols(0, width_), rows, a[kValue]),
                 advantage_.Forward(weights, hidden.Cols(width_, width_), rows, a[kAdvantage]), y);
}

template <typename T>
void DuelingHead<T>::ForwardAdvantages(std::span<const T> parameters, Matrix<const T> x,
                                       RowRange rows, Activations& a, Matrix<T> advantages) const {
  const Matrix<T> hidden = RowsOf(a[kStreams].output, rows, 2 * width_).Cols(width_, width_);
  const Matrix<const T> w = streams_.W(parameters).Cols(width_, width_);
  const auto b = streams_.b(parameters).subspan(static_cast<size_t>(width_));
  LinearForward(x, w, b, true, hidden);
  LinearForward<T>(hidden, advantage_.W(parameters), advantage_.b(parameters), false, advantages);
}

template <typename T>
void DuelingHead<T>::Backward(Weights<T> weights, Matrix<const T> dy, RowRange rows, Activations& a,
                              GradientPlace<T> input) const {
  const GradientPlace<T> hidden = streams_.OutputGradient(rows, a[kStreams]);
  const auto half = [&](int first) -> GradientPlace<T> {
    return {hidden.dx.Cols(first, width_), hidden.gate.Cols(first, width_)};
  };
  CombineStreamsBackward(dy, value_.OutputGradient(rows, a[kValue]).dx,
                         advantage_.OutputGradient(rows, a[kAdvantage]).dx);
  value_.Backward(weights, rows, a[kValue], half(0));
  advantage_.Backward(weights, rows, a[kAdvantage], half(width_));
  streams_.Backward(weights, rows, a[kStreams], input);
}

template <typename T>
T DuelingHead<T>::BackwardWeights(size_t layer, RowRange rows, Matrix<const T> x,
                                  const Activations& a, std::span<T> gradient) const {
  const Matrix<const T> hidden = streams_.Output({0, x.rows()}, a[kStreams]);
  switch (layer) {
    case kStreams:
      return streams_.BackwardWeights(rows, x, a[layer], gradient);
    case kValue:
      return value_.BackwardWeights(rows, hidden.Cols(0, width_), a[layer], gradient);
    default:
      return advantage_.BackwardWeights(rows, hidden.Cols(width_, width_), a[layer], gradient);
  }
}

template class DuelingHead<float>;
template class DuelingHead<double>;

}  // namespace upswing
