// The kernels of small networks, written once with Highway and compiled for each kind of vector
// instructions; the matrix products are product.cc.
#include "nn/linear.h"

#include "nn/product.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nn/linear.cc"
#include <hwy/foreach_target.h>  // includes this file once for each target
// must come after foreach_target
#include <hwy/highway.h>
// its functions, for each target
#include <hwy/contrib/math/math-inl.h>

#include "nn/registers-inl.h"

#ifndef UPSWING_NN_LINEAR_ONCE  // what all targets share
#define UPSWING_NN_LINEAR_ONCE
#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>

namespace upswing {

/// The kernels of one target.
template <typename T>
struct KernelTable {
  decltype(&Transpose<T>) transpose;
  decltype(&SumRows<T>) sum_rows;
  decltype(&LayerNormForward<T>) layer_norm_forward;
  decltype(&LayerNormBackwardInput<T>) layer_norm_backward_input;
  decltype(&LayerNormBackwardGain<T>) layer_norm_backward_gain;
  decltype(&Tanh<T>) tanh;
  decltype(&TanhBackward<T>) tanh_backward;
  decltype(&SquashSamples<T>) squash_samples;
  decltype(&SquaredNorm<T>) squared_norm;
  decltype(&AdamPolyakStep<T>) adam_polyak_step;
};

}  // namespace upswing
#endif

HWY_BEFORE_NAMESPACE();
namespace upswing::HWY_NAMESPACE {
/// y = xᵀ. Floats go by blocks of 4 × 4 in registers of four.
template <typename T>
void Transpose(Matrix<const T> x, Matrix<T> y) {
  int rows = 0;  // done by blocks
  int cols = 0;
#if HWY_TARGET != HWY_SCALAR
  if constexpr (sizeof(T) == 4) {
    const hn::Full128<T> d;
    rows = x.rows() / 4 * 4;
    cols = x.cols() / 4 * 4;
    for (int c = 0; c < cols; c += 4) {
      for (int r = 0; r < rows; r += 4) {
        hn::Vec<decltype(d)> block[4];
        HWY_UNROLL(4)
        for (int i = 0; i < 4; ++i) block[i] = hn::LoadU(d, &x(r + i, c));
        TransposeBlocks(d, block);
        HWY_UNROLL(4)
        for (int i = 0; i < 4; ++i) hn::StoreU(block[i], d, &y(c + i, r));
      }
    }
  }
#endif
  for (int r = 0; r < x.rows(); ++r) {
    for (int c = r < rows ? cols : 0; c < x.cols(); ++c) y(c, r) = x(r, c);
  }
}

template <typename T>
void SumRows(Matrix<const T> x, std::span<T> sum) {
  // Four registers at a time: each addition waits for the one before it.
  const Tag<T> d;
  const size_t lanes = hn::Lanes(d);
  size_t done = 0;
  for (; done + 4 * lanes <= sum.size(); done += 4 * lanes) {
    Vec<T> column[4] = {hn::Zero(d), hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for (int r = 0; r < x.rows(); ++r) {
      const T* row = x.row(r).data() + done;
      HWY_UNROLL(4)
      for (size_t v = 0; v < 4; ++v) column[v] = hn::Add(column[v], hn::LoadU(d, row + v * lanes));
    }
    HWY_UNROLL(4)
    for (size_t v = 0; v < 4; ++v) hn::StoreU(column[v], d, sum.data() + done + v * lanes);
  }
  ForVectors<T>(sum.size() - done, [&](size_t first, size_t count, auto partial) HWY_ATTR {
    const size_t i = done + first;
    Vec<T> column = hn::Zero(Tag<T>());
    for (int r = 0; r < x.rows(); ++r) {
      column = hn::Add(column, Load<partial.value>(x.row(r).data() + i, count));
    }
    Store<partial.value>(column, sum.data() + i, count);
  });
}

template <typename T>
void LayerNormForward(Matrix<T> x, std::span<const T> gain, std::span<const T> bias,
                      std::span<T> inv_std, bool relu, Matrix<T> y) {
  constexpr T kEpsilon = T(1e-5);
  // Some rows at a time, each step for all of them: within a row each waits for the one before it.
  constexpr int kRows = 8;
  const Tag<T> d;
  const auto n = static_cast<size_t>(x.cols());
  for (int first = 0; first < x.rows(); first += kRows) {
    const int rows = std::min(kRows, x.rows() - first);
    T mean[kRows], square[kRows];
    for (int k = 0; k < rows; ++k) {
      const T* row = x.row(first + k).data();
      mean[k] = SumVectors<T>(n, [&](size_t i, size_t count, auto partial)
                                     HWY_ATTR { return Load<partial.value>(row + i, count); }) /
                static_cast<T>(n);
    }
    for (int k = 0; k < rows; ++k) {
      const T* row = x.row(first + k).data();
      const Vec<T> center = hn::Set(d, mean[k]);
      square[k] = SumVectors<T>(n, [&](size_t i, size_t count, auto partial) HWY_ATTR {
        Vec<T> e = hn::Sub(Load<partial.value>(row + i, count), center);
        if constexpr (partial.value) e = hn::IfThenElseZero(hn::FirstN(d, count), e);
        return hn::Mul(e, e);
      });
    }
    for (int k = 0; k < rows; ++k) {
      inv_std[static_cast<size_t>(first + k)] =
          T{1} / std::sqrt(square[k] / static_cast<T>(n) + kEpsilon);
    }
    for (int k = 0; k < rows; ++k) {
      T* row = x.row(first + k).data();
      T* out = y.row(first + k).data();
      const Vec<T> center = hn::Set(d, mean[k]);
      const Vec<T> scale = hn::Set(d, inv_std[static_cast<size_t>(first + k)]);
      ForVectors<T>(n, [&](size_t i, size_t count, auto partial) HWY_ATTR {
        const Vec<T> x_hat = hn::Mul(hn::Sub(Load<partial.value>(row + i, count), center), scale);
        Store<partial.value>(x_hat, row + i, count);
        const Vec<T> normal = hn::MulAdd(Load<partial.value>(gain.data() + i, count), x_hat,
                                         Load<partial.value>(bias.data() + i, count));
        Store<partial.value>(relu ? hn::Max(normal, hn::Zero(d)) : normal, out + i, count);
      });
    }
  }
}

template <typename T>
void LayerNormBackwardInput(Matrix<const T> x_hat, std::span<const T> gain,
                            std::span<const T> inv_std, Matrix<const T> dy, Matrix<T> dx) {
  const Tag<T> d;
  const auto n = static_cast<size_t>(dy.cols());
  for (int r = 0; r < dy.rows(); ++r) {
    const T* normal = x_hat.row(r).data();
    const T* gradient = dy.row(r).data();
    // dx = inv_std (g - mean(g) - x̂ mean(g x̂)) with g = gain · dy
    const auto g = [&](size_t i, size_t count, auto partial) HWY_ATTR {
      return hn::Mul(Load<partial.value>(gain.data() + i, count),
                     Load<partial.value>(gradient + i, count));
    };
    const T mean = SumVectors<T>(n, g) / static_cast<T>(n);
    const T along = SumVectors<T>(n,
                                  [&](size_t i, size_t count, auto partial) HWY_ATTR {
                                    return hn::Mul(g(i, count, partial),
                                                   Load<partial.value>(normal + i, count));
                                  }) /
                    static_cast<T>(n);
    ForVectors<T>(n, [&](size_t i, size_t count, auto partial) HWY_ATTR {
      const Vec<T> rest = hn::Sub(g(i, count, partial), hn::Set(d, mean));
      const Vec<T> result =
          hn::NegMulAdd(Load<partial.value>(normal + i, count), hn::Set(d, along), rest);
      const Vec<T> scale = hn::Set(d, inv_std[static_cast<size_t>(r)]);
      Store<partial.value>(hn::Mul(scale, result), dx.row(r).data() + i, count);
    });
  }
}

template <typename T>
void LayerNormBackwardGain(Matrix<const T> x_hat, Matrix<const T> dy, std::span<T> dgain) {
  ForVectors<T>(dgain.size(), [&](size_t i, size_t count, auto partial) HWY_ATTR {
    Vec<T> sum = hn::Zero(Tag<T>());
    for (int r = 0; r < dy.rows(); ++r) {
      sum = hn::MulAdd(Load<partial.value>(dy.row(r).data() + i, count),
                       Load<partial.value>(x_hat.row(r).data() + i, count), sum);
    }
    Store<partial.value>(sum, dgain.data() + i, count);
  });
}

/// tanh(x) = x P(x²) / Q(x²), a rational approximation with the coefficients of Eigen 3.4
/// (generic_fast_tanh_float). Beyond ±7.9 the result is that of ±7.9, which is ±1 up to rounding.
HWY_INLINE Vec<float> TanhOf(Vec<float> x) {
  constexpr float kLargest = 7.90531110763549805F;
  constexpr float kP[] = {4.89352455891786e-03F, 6.37261928875436e-04F,  1.48572235717979e-05F,
                          5.12229709037114e-08F, -8.60467152213735e-11F, 2.00018790482477e-13F,
                          -2.76076847742355e-16F};
  constexpr float kQ[] = {4.89352518554385e-03F, 2.26843463243900e-03F, 1.18534705686654e-04F,
                          1.19825839466702e-06F};
  const Tag<float> d;
  const Vec<float> largest = hn::Set(d, kLargest);
  const Vec<float> near = hn::IfThenElse(hn::Gt(hn::Abs(x), largest), hn::CopySign(largest, x), x);
  const Vec<float> square = hn::Mul(near, near);
  Vec<float> p = hn::Set(d, kP[6]);
  HWY_UNROLL(6)
  for (int i = 5; i >= 0; --i) p = hn::MulAdd(p, square, hn::Set(d, kP[i]));
  Vec<float> q = hn::Set(d, kQ[3]);
  HWY_UNROLL(3)
  for (int i = 2; i >= 0; --i) q = hn::MulAdd(q, square, hn::Set(d, kQ[i]));
  return hn::Mul(near, hn::Div(p, q));
}
HWY_INLINE Vec<double> TanhOf(Vec<double> x) { return hn::Tanh(Tag<double>(), x); }

template <typename T>
void Tanh(std::span<T> x) {
  ForVectors<T>(x.size(), [&](size_t i, size_t count, auto partial) HWY_ATTR {
    const Vec<T> value = Load<partial.value>(x.data() + i, count);
    Store<partial.value>(TanhOf(value), x.data() + i, count);
  });
}

template <typename T>
void TanhBackward(std::span<const T> y, std::span<T> dy) {
  const Vec<T> one = hn::Set(Tag<T>(), T{1});
  ForVectors<T>(y.size(), [&](size_t i, size_t count, auto partial) HWY_ATTR {
    const Vec<T> value = Load<partial.value>(y.data() + i, count);
    const Vec<T> slope = hn::NegMulAdd(value, value, one);
    const Vec<T> gradient = Load<partial.value>(dy.data() + i, count);
    Store<partial.value>(hn::Mul(gradient, slope), dy.data() + i, count);
  });
}

template <typename T>
void SquashSamples(std::span<const T> mean, std::span<const T> log_std, std::span<const T> epsilon,
                   std::span<T> deviation, std::span<T> action, std::span<T> log_prob) {
  constexpr T kLogTwo = std::numbers::ln2_v<T>;
  constexpr T kHalfLogTwoPi = T(0.91893853320467274178);
  const Tag<T> d;
  const auto one = hn::Set(d, T{1}), two = hn::Set(d, T{2});
  ForVectors<T>(mean.size(), [&](size_t i, size_t count, auto partial) HWY_ATTR {
    const auto load = [&](auto values)
                          HWY_ATTR { return Load<partial.value>(values.data() + i, count); };
    const auto store = [&](Vec<T> value, std::span<T> to)
                           HWY_ATTR { Store<partial.value>(value, to.data() + i, count); };
    const Vec<T> noise = load(epsilon), log_sigma = load(log_std), sigma = hn::Exp(d, log_sigma);
    const Vec<T> u = hn::MulAdd(sigma, noise, load(mean)), size = hn::Abs(u);
    // e = exp(-2 |u|) serves tanh and ln(1 - tanh²).
    const Vec<T> e = hn::Exp(d, hn::Neg(hn::Add(size, size)));
    const Vec<T> rest = hn::Add(size, hn::Log1p(d, e));
    const Vec<T> slope = hn::Mul(two, hn::Sub(hn::Set(d, kLogTwo), rest));
    const Vec<T> density = hn::NegMulAdd(hn::Mul(noise, noise), hn::Set(d, T(0.5)),
                                         hn::Neg(hn::Add(log_sigma, hn::Set(d, kHalfLogTwoPi))));
    store(sigma, deviation);
    store(hn::CopySign(hn::Div(hn::Sub(one, e), hn::Add(one, e)), u), action);
    store(hn::Sub(density, slope), log_prob);
  });
}

template <typename T>
T SquaredNorm(std::span<const T> x) {
  return SumVectors<T>(x.size(), [&](size_t i, size_t count, auto partial) HWY_ATTR {
    const Vec<T> value = Load<partial.value>(x.data() + i, count);
    return hn::Mul(value, value);
  });
}

template <typename T>
void AdamPolyakStep(const AdamConstants<T>& constants, std::span<const T> g, std::span<T> m,
                    std::span<T> v, std::span<T> p, std::span<T> target) {
  const Tag<T> d;
  const Vec<T> beta1 = hn::Set(d, constants.beta1);
  const Vec<T> beta2 = hn::Set(d, constants.beta2);
  const Vec<T> rest1 = hn::Set(d, T{1} - constants.beta1);
  const Vec<T> rest2 = hn::Set(d, T{1} - constants.beta2);
  const Vec<T> scale = hn::Set(d, constants.scale);
  const Vec<T> step = hn::Set(d, constants.step);
  const Vec<T> epsilon = hn::Set(d, constants.epsilon);
  const Vec<T> tau = hn::Set(d, constants.tau);
  ForVectors<T>(g.size(), [&](size_t i, size_t count, auto partial) HWY_ATTR {
    const auto load = [&](auto values)
                          HWY_ATTR { return Load<partial.value>(values.data() + i, count); };
    const auto store = [&](Vec<T> value, std::span<T> to)
                           HWY_ATTR { Store<partial.value>(value, to.data() + i, count); };
    const Vec<T> gradient = hn::Mul(load(g), scale);
    const Vec<T> m_new = hn::MulAdd(beta1, load(m), hn::Mul(rest1, gradient));
    const Vec<T> v_new = hn::MulAdd(beta2, load(v), hn::Mul(rest2, hn::Mul(gradient, gradient)));
    const Vec<T> move = hn::Div(hn::Mul(step, m_new), hn::Add(hn::Sqrt(v_new), epsilon));
    const Vec<T> p_new = hn::Sub(load(p), move);
    store(m_new, m);
    store(v_new, v);
    store(p_new, p);
    if (target.empty()) return;
    const Vec<T> old_target = load(target);
    store(hn::MulAdd(tau, hn::Sub(p_new, old_target), old_target), target);
  });
}

// ------------------------------------------------------------------------------------------------
// Rooflines, against which kernels are measured.

template <typename T>
constexpr KernelTable<T> kKernels{
    &Transpose<T>,
    &SumRows<T>,
    &LayerNormForward<T>,
    &LayerNormBackwardInput<T>,
    &LayerNormBackwardGain<T>,
    &Tanh<T>,
    &TanhBackward<T>,
    &SquashSamples<T>,
    &SquaredNorm<T>,
    &AdamPolyakStep<T>,
};
const KernelTable<float>* FloatKernels() { return &kKernels<float>; }
const KernelTable<double>* DoubleKernels() { return &kKernels<double>; }

}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace upswing {
namespace {

HWY_EXPORT(FloatKernels);
HWY_EXPORT(DoubleKernels);

/// The kernels of the target in use.
template <typename T>
const KernelTable<T>& Kernels() {
  if constexpr (std::is_same_v<T, float>) {
    return *HWY_DYNAMIC_DISPATCH(FloatKernels)();
  } else {
    return *HWY_DYNAMIC_DISPATCH(DoubleKernels)();
  }
}

}  // namespace

template <typename T>
void LinearForward(Matrix<const T> x, Matrix<const T> w, std::span<const T> b, bool relu,
                   Matrix<T> y) {
  Multiply({.M = y.rows(),
            .N = y.cols(),
            .K = x.cols(),
            .a = x.data(),
            .a_m = x.stride(),
            .a_k = 1,
            .b = w,
            .c = y,
            .bias = b.data(),
            .relu = relu});
}

template <typename T>
void LinearBackwardInput(Matrix<const T> dy, Matrix<const T> w_transposed, Matrix<const T> gate,
                         Matrix<T> dx) {
  Multiply({.M = dx.rows(),
            .N = dx.cols(),
            .K = dy.cols(),
            .a = dy.data(),
            .a_m = dy.stride(),
            .a_k = 1,
            .b = w_transposed,
            .c = dx,
            .gate = gate});
}

template <typename T>
void LinearBackwardWeight(Matrix<const T> x, Matrix<const T> dy, Matrix<T> dw) {
  if (dw.cols() == 1 && dw.stride() == 1) {
    // One column is computed as its transpose, a row that fills registers: the same sums.
    return Multiply({.M = 1,
                     .N = dw.rows(),
                     .K = x.rows(),
                     .a = dy.data(),
                     .a_m = 0,
                     .a_k = dy.stride(),
                     .b = x,
                     .c = {dw.data(), 1, dw.rows()}});
  }
  Multiply({.M = dw.rows(),
            .N = dw.cols(),
            .K = x.rows(),
            .a = x.data(),
            .a_m = 1,
            .a_k = x.stride(),
            .b = dy,
            .c = dw});
}

template <typename T>
void Transpose(Matrix<const T> x, Matrix<T> y) {
  Kernels<T>().transpose(x, y);
}

template <typename T>
void SumRows(Matrix<const T> x, std::span<T> sum) {
  Kernels<T>().sum_rows(x, sum);
}

template <typename T>
void LayerNormForward(Matrix<T> x, std::span<const T> gain, std::span<const T> bias,
                      std::span<T> inv_std, bool relu, Matrix<T> y) {
  Kernels<T>().layer_norm_forward(x, gain, bias, inv_std, relu, y);
}

template <typename T>
void LayerNormBackwardInput(Matrix<const T> x_hat, std::span<const T> gain,
                            std::span<const T> inv_std, Matrix<const T> dy, Matrix<T> dx) {
  Kernels<T>().layer_norm_backward_input(x_hat, gain, inv_std, dy, dx);
}

template <typename T>
void LayerNormBackwardGain(Matrix<const T> x_hat, Matrix<const T> dy, std::span<T> dgain) {
  Kernels<T>().layer_norm_backward_gain(x_hat, dy, dgain);
}

template <typename T>
void Tanh(std::span<T> x) {
  Kernels<T>().tanh(x);
}

template <typename T>
void TanhBackward(std::span<const T> y, std::span<T> dy) {
  Kernels<T>().tanh_backward(y, dy);
}

template <typename T>
void SquashSamples(std::span<const T> mean, std::span<const T> log_std, std::span<const T> epsilon,
                   std::span<T> deviation, std::span<T> action, std::span<T> log_prob) {
  Kernels<T>().squash_samples(mean, log_std, epsilon, deviation, action, log_prob);
}

template <typename T>
T SquaredNorm(std::span<const T> x) {
  return Kernels<T>().squared_norm(x);
}

template <typename T>
void AdamPolyakStep(const AdamConstants<T>& constants, std::span<const T> g, std::span<T> m,
                    std::span<T> v, std::span<T> p, std::span<T> target) {
  Kernels<T>().adam_polyak_step(constants, g, m, v, p, target);
}

// Float for training, double to check gradients by finite differences.
#define UPSWING_INSTANTIATE(T)                                                                     \
  template void LinearForward(Matrix<const T>, Matrix<const T>, std::span<const T>, bool,          \
                              Matrix<T>);                                                          \
  template void LinearBackwardInput(Matrix<const T>, Matrix<const T>, Matrix<const T>, Matrix<T>); \
  template void LinearBackwardWeight(Matrix<const T>, Matrix<const T>, Matrix<T>);                 \
  template void Transpose(Matrix<const T>, Matrix<T>);                                             \
  template void SumRows(Matrix<const T>, std::span<T>);                                            \
  template void LayerNormForward(Matrix<T>, std::span<const T>, std::span<const T>, std::span<T>,  \
                                 bool, Matrix<T>);                                                 \
  template void LayerNormBackwardInput(Matrix<const T>, std::span<const T>, std::span<const T>,    \
                                       Matrix<const T>, Matrix<T>);                                \
  template void LayerNormBackwardGain(Matrix<const T>, Matrix<const T>, std::span<T>);             \
  template void Tanh(std::span<T>);                                                                \
  template void TanhBackward(std::span<const T>, std::span<T>);                                    \
  template void SquashSamples(std::span<const T>, std::span<const T>, std::span<const T>,          \
                              std::span<T>, std::span<T>, std::span<T>);                           \
  template T SquaredNorm(std::span<const T>);                                                      \
  template void AdamPolyakStep(const AdamConstants<T>&, std::span<const T>, std::span<T>,          \
                               std::span<T>, std::span<T>, std::span<T>);
UPSWING_INSTANTIATE(float)
UPSWING_INSTANTIATE(double)
#undef UPSWING_INSTANTIATE

}  // namespace upswing
#endif  // HWY_ONCE
