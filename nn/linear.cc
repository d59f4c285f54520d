#include "nn/linear.h"

#include <Eigen/Core>

namespace upswing {
namespace {

template <typename T>
using Map = Eigen::Map<Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
template <typename T>
using ConstMap =
    Eigen::Map<const Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
template <typename T>
using ArrayMap = Eigen::Map<Eigen::Array<T, Eigen::Dynamic, 1>>;
template <typename T>
using ConstArrayMap = Eigen::Map<const Eigen::Array<T, Eigen::Dynamic, 1>>;

template <typename T>
Map<T> View(Matrix<T> x) {
  return {x.data(), x.rows(), x.cols()};
}
template <typename T>
ConstMap<T> View(Matrix<const T> x) {
  return {x.data(), x.rows(), x.cols()};
}
template <typename T>
ArrayMap<T> View(std::span<T> x) {
  return {x.data(), static_cast<Eigen::Index>(x.size())};
}
template <typename T>
ConstArrayMap<T> View(std::span<const T> x) {
  return {x.data(), static_cast<Eigen::Index>(x.size())};
}

}  // namespace

template <typename T>
void LinearForward(Matrix<const T> x, Matrix<const T> w, std::span<const T> b, Matrix<T> y) {
  auto out = View(y);
  out.rowwise() = View(b).matrix().transpose();
  out.noalias() += View(x) * View(w).transpose();
}

template <typename T>
void LinearBackward(Matrix<const T> x, Matrix<const T> w, Matrix<const T> dy, Matrix<T> dw,
                    std::span<T> db, Matrix<T> dx) {
  View(dw).noalias() = View(dy).transpose() * View(x);
  View(db).matrix().transpose() = View(dy).colwise().sum();
  if (!dx.empty()) View(dx).noalias() = View(dy) * View(w);
}

template <typename T>
void ReluForward(Matrix<T> y) {
  auto values = View(y.values());
  values = values.max(T{0});
}

template <typename T>
void ReluBackward(Matrix<const T> y, Matrix<T> dy) {
  auto gradient = View(dy.values());
  gradient = (View(y.values()) > T{0}).select(gradient, T{0});
}

template <typename T>
void LayerNormForward(Matrix<T> x, std::span<const T> gain, std::span<const T> bias,
                      std::span<T> inv_std, Matrix<T> y) {
  constexpr T kEpsilon = T(1e-5);
  for (int i = 0; i < x.rows(); ++i) {
    auto row = View(x.row(i));
    row -= row.mean();
    const T scale = T{1} / std::sqrt(row.square().mean() + kEpsilon);
    row *= scale;
    inv_std[static_cast<size_t>(i)] = scale;
    View(y.row(i)) = View(gain) * row + View(bias);
  }
}

template <typename T>
void LayerNormBackward(Matrix<const T> x_hat, std::span<const T> gain, std::span<const T> inv_std,
                       std::span<T> dgain, std::span<T> dbias, Matrix<T> dy) {
  View(dgain).setZero();
  View(dbias).setZero();
  for (int i = 0; i < dy.rows(); ++i) {
    auto gradient = View(dy.row(i));
    const auto normal = View(x_hat.row(i));
    View(dgain) += gradient * normal;
    View(dbias) += gradient;
    // dx = inv_std (g - mean(g) - x̂ mean(g x̂)) with g = gain · dy
    gradient *= View(gain);
    const T mean = gradient.mean();
    const T along = (gradient * normal).mean();
    gradient = inv_std[static_cast<size_t>(i)] * (gradient - mean - normal * along);
  }
}

template <typename T>
T SquaredNorm(std::span<const T> x) {
  return View(x).matrix().squaredNorm();
}

template <typename T>
void AddTo(std::span<const T> x, std::span<T> y) {
  View(y) += View(x);
}

template <typename T>
void MoveTowards(std::span<const T> x, T tau, std::span<T> y) {
  View(y) += tau * (View(x) - View(y));
}

template <typename T>
void AdamStep(std::span<const T> g, T scale, T beta1, T beta2, T step, T epsilon, std::span<T> m,
              std::span<T> v, std::span<T> p) {
  View(m) = beta1 * View(m) + (T{1} - beta1) * scale * View(g);
  View(v) = beta2 * View(v) + (T{1} - beta2) * (scale * View(g)).square();
  View(p) -= step * View(m) / (View(v).sqrt() + epsilon);
}

// Float to work with, double to check gradients by finite differences.
#define UPSWING_INSTANTIATE(T)                                                                    \
  template void LinearForward(Matrix<const T>, Matrix<const T>, std::span<const T>, Matrix<T>);   \
  template void LinearBackward(Matrix<const T>, Matrix<const T>, Matrix<const T>, Matrix<T>,      \
                               std::span<T>, Matrix<T>);                                          \
  template void ReluForward(Matrix<T>);                                                           \
  template void ReluBackward(Matrix<const T>, Matrix<T>);                                         \
  template void LayerNormForward(Matrix<T>, std::span<const T>, std::span<const T>, std::span<T>, \
                                 Matrix<T>);                                                      \
  template void LayerNormBackward(Matrix<const T>, std::span<const T>, std::span<const T>,        \
                                  std::span<T>, std::span<T>, Matrix<T>);                         \
  template T SquaredNorm(std::span<const T>);                                                     \
  template void AddTo(std::span<const T>, std::span<T>);                                          \
  template void MoveTowards(std::span<const T>, T, std::span<T>);                                 \
  template void AdamStep(std::span<const T>, T, T, T, T, T, std::span<T>, std::span<T>,           \
                         std::span<T>);
UPSWING_INSTANTIATE(float)
UPSWING_INSTANTIATE(double)
#undef UPSWING_INSTANTIATE

}  // namespace upswing
