// The kernels for small networks, written once with Highway and compiled for each instruction set.
// product.cc has the matrix products.
#include "nn/linear.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>

#include "base/simd.h"
#include "nn/product.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nn/linear.cc"
#include <hwy/foreach_target.h>  // includes this file once per target
// must come after foreach_target.h
#include <hwy/highway.h>
// must come after highway.h; compiled per target
#include <hwy/contrib/math/math-inl.h>

#include "nn/registers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace upswing::HWY_NAMESPACE {
/// y = xᵀ. Floats go through registers, four columns at a time.
void Transpose(Matrix<const Real> x, Matrix<Real> y) {
  if ((x.cols() == 1 && x.stride() == 1) || (x.rows() == 1 && y.stride() == 1)) {
    std::copy_n(x.data(), x.size(), y.data());  // a vector
    return;
  }
  int rows = 0;  // transposed in blocks so far
  int cols = 0;
#if HWY_TARGET != HWY_SCALAR
  if constexpr (sizeof(Real) == 4) {
    const Tag d;
    constexpr int kRows = kLanes;
    rows = x.rows() / kRows * kRows;
    cols = x.cols() / 4 * 4;
    for (int c = 0; c < cols; c += 4) {
      for (int r = 0; r < rows; r += kRows) {
        Vec columns[4];
        LoadColumns(d, &x(r, c), x.stride(), columns);
        HWY_UNROLL(4)
        for (int i = 0; i < 4; ++i) hn::StoreU(columns[i], d, &y(c + i, r));
      }
    }
  }
#endif
  for (int r = 0; r < x.rows(); ++r) {
    for (int c = r < rows ? cols : 0; c < x.cols(); ++c) y(c, r) = x(r, c);
  }
}

void LayerNormForward(Matrix<Real> x, std::span<const Real> gain, std::span<const Real> bias,
                      std::span<Real> inv_std, bool relu, Matrix<Real> y) {
  constexpr Real kEpsilon = Real(1e-5);
  // Process kRows rows at a time, step by step, because the steps of one row wait for each other.
  constexpr int kRows = 8;
  const Tag d;
  const auto n = static_cast<size_t>(x.cols());
  for (int first = 0; first < x.rows(); first += kRows) {
    const int rows = std::min(kRows, x.rows() - first);
    Real mean[kRows], square[kRows];
    for (int k = 0; k < rows; ++k) {
      const Real* row = x.row(first + k).data();
      mean[k] = SumVectors(n, [&](size_t i, size_t count, auto partial)
                                  HWY_ATTR { return Load<partial.value>(row + i, count); }) /
                static_cast<Real>(n);
    }
    for (int k = 0; k < rows; ++k) {
      const Real* row = x.row(first + k).data();
      const Vec center = hn::Set(d, mean[k]);
      square[k] = SumVectors(n, [&](size_t i, size_t count, auto partial) HWY_ATTR {
        Vec e = hn::Sub(Load<partial.value>(row + i, count), center);
        if constexpr (partial.value) e = hn::IfThenElseZero(hn::FirstN(d, count), e);
        return hn::Mul(e, e);
      });
    }
    for (int k = 0; k < rows; ++k) {
      inv_std[first + k] = Real{1} / std::sqrt(square[k] / static_cast<Real>(n) + kEpsilon);
    }
    for (int k = 0; k < rows; ++k) {
      Real* row = x.row(first + k).data();
      Real* out = y.row(first + k).data();
      const Vec center = hn::Set(d, mean[k]);
      const Vec scale = hn::Set(d, inv_std[first + k]);
      ForVectors(n, [&](size_t i, size_t count, auto partial) HWY_ATTR {
        const Vec x_hat = hn::Mul(hn::Sub(Load<partial.value>(row + i, count), center), scale);
        Store<partial.value>(x_hat, row + i, count);
        const Vec normal = hn::MulAdd(Load<partial.value>(gain.data() + i, count), x_hat,
                                      Load<partial.value>(bias.data() + i, count));
        Store<partial.value>(relu ? hn::Max(normal, hn::Zero(d)) : normal, out + i, count);
      });
    }
  }
}

void LayerNormBackwardInput(Matrix<const Real> x_hat, std::span<const Real> gain,
                            std::span<const Real> inv_std, Matrix<const Real> dy, Matrix<Real> dx) {
  const Tag d;
  const auto n = static_cast<size_t>(dy.cols());
  for (int r = 0; r < dy.rows(); ++r) {
    const Real* normal = x_hat.row(r).data();
    const Real* gradient = dy.row(r).data();
    // dx = inv_std (g - mean(g) - x̂ mean(g x̂)) with g = gain · dy
    const auto g = [&](size_t i, size_t count, auto partial) HWY_ATTR {
      return hn::Mul(Load<partial.value>(gain.data() + i, count),
                     Load<partial.value>(gradient + i, count));
    };
    const Real mean = SumVectors(n, g) / static_cast<Real>(n);
    const Real along =
        SumVectors(n,
                   [&](size_t i, size_t count, auto partial) HWY_ATTR {
                     return hn::Mul(g(i, count, partial), Load<partial.value>(normal + i, count));
                   }) /
        static_cast<Real>(n);
    ForVectors(n, [&](size_t i, size_t count, auto partial) HWY_ATTR {
      const Vec rest = hn::Sub(g(i, count, partial), hn::Set(d, mean));
      const Vec result =
          hn::NegMulAdd(Load<partial.value>(normal + i, count), hn::Set(d, along), rest);
      const Vec scale = hn::Set(d, inv_std[r]);
      Store<partial.value>(hn::Mul(scale, result), dx.row(r).data() + i, count);
    });
  }
}

void LayerNormBackwardGain(Matrix<const Real> x_hat, Matrix<const Real> dy, std::span<Real> dgain) {
  // Sum four registers at a time, because each sum waits for its previous row.
  const auto add = [&](Vec sum, int r, size_t i, size_t count, auto partial) HWY_ATTR {
    return hn::MulAdd(Load<partial.value>(dy.row(r).data() + i, count),
                      Load<partial.value>(x_hat.row(r).data() + i, count), sum);
  };
  size_t done = 0;
  for (; done + 4 * kLanes <= dgain.size(); done += 4 * kLanes) {
    Vec sum[4] = {hn::Zero(Tag()), hn::Zero(Tag()), hn::Zero(Tag()), hn::Zero(Tag())};
    for (int r = 0; r < dy.rows(); ++r) {
      HWY_UNROLL(4)
      for (size_t v = 0; v < 4; ++v) {
        sum[v] = add(sum[v], r, done + v * kLanes, kLanes, std::false_type());
      }
    }
    HWY_UNROLL(4)
    for (size_t v = 0; v < 4; ++v) hn::StoreU(sum[v], Tag(), dgain.data() + done + v * kLanes);
  }
  ForVectors(dgain.size() - done, [&](size_t i, size_t count, auto partial) HWY_ATTR {
    Vec sum = hn::Zero(Tag());
    for (int r = 0; r < dy.rows(); ++r) sum = add(sum, r, done + i, count, partial);
    Store<partial.value>(sum, dgain.data() + done + i, count);
  });
}

/// tanh(x) = x P(x²) / Q(x²), a rational approximation with the coefficients of Eigen 3.4
/// (generic_fast_tanh_float). Inputs beyond ±7.9 are clamped to ±7.9, where tanh is ±1 up to
/// rounding.
HWY_INLINE Vec TanhOf(Vec x) {
  constexpr Real kLargest = 7.90531110763549805F;
  constexpr Real kP[] = {4.89352455891786e-03F, 6.37261928875436e-04F,  1.48572235717979e-05F,
                         5.12229709037114e-08F, -8.60467152213735e-11F, 2.00018790482477e-13F,
                         -2.76076847742355e-16F};
  constexpr Real kQ[] = {4.89352518554385e-03F, 2.26843463243900e-03F, 1.18534705686654e-04F,
                         1.19825839466702e-06F};
  const Tag d;
  if constexpr (std::is_same_v<Real, double>) return hn::Tanh(d, x);
  const Vec largest = hn::Set(d, kLargest);
  const Vec near = hn::IfThenElse(hn::Gt(hn::Abs(x), largest), hn::CopySign(largest, x), x);
  const Vec square = hn::Mul(near, near);
  Vec p = hn::Set(d, kP[6]);
  HWY_UNROLL(6)
  for (int i = 5; i >= 0; --i) p = hn::MulAdd(p, square, hn::Set(d, kP[i]));
  Vec q = hn::Set(d, kQ[3]);
  HWY_UNROLL(3)
  for (int i = 2; i >= 0; --i) q = hn::MulAdd(q, square, hn::Set(d, kQ[i]));
  return hn::Mul(near, hn::Div(p, q));
}

void Tanh(std::span<Real> x) {
  ForVectors(x.size(), [&](size_t i, size_t count, auto partial) HWY_ATTR {
    const Vec value = Load<partial.value>(x.data() + i, count);
    Store<partial.value>(TanhOf(value), x.data() + i, count);
  });
}

void TanhBackward(std::span<const Real> y, std::span<Real> dy) {
  const Vec one = hn::Set(Tag(), Real{1});
  ForVectors(y.size(), [&](size_t i, size_t count, auto partial) HWY_ATTR {
    const Vec value = Load<partial.value>(y.data() + i, count);
    const Vec slope = hn::NegMulAdd(value, value, one);
    const Vec gradient = Load<partial.value>(dy.data() + i, count);
    Store<partial.value>(hn::Mul(gradient, slope), dy.data() + i, count);
  });
}

void SquashSamples(std::span<const Real> mean, std::span<const Real> log_std,
                   std::span<const Real> epsilon, std::span<Real> deviation, std::span<Real> action,
                   std::span<Real> log_prob) {
  constexpr Real kLogTwo = std::numbers::ln2_v<Real>;
  constexpr Real kHalfLogTwoPi = Real(0.91893853320467274178);
  const Tag d;
  const auto one = hn::Set(d, Real{1}), two = hn::Set(d, Real{2});
  ForVectors(mean.size(), [&](size_t i, size_t count, auto partial) HWY_ATTR {
    const auto load = [&](auto values)
                          HWY_ATTR { return Load<partial.value>(values.data() + i, count); };
    const auto store = [&](Vec value, std::span<Real> to)
                           HWY_ATTR { Store<partial.value>(value, to.data() + i, count); };
    const Vec noise = load(epsilon), log_sigma = load(log_std), sigma = hn::Exp(d, log_sigma);
    const Vec u = hn::MulAdd(sigma, noise, load(mean)), size = hn::Abs(u);
    // tanh and ln(1 - tanh²) share e = exp(-2 |u|).
    const Vec e = hn::Exp(d, hn::Neg(hn::Add(size, size)));
    const Vec rest = hn::Add(size, hn::Log1p(d, e));
    const Vec slope = hn::Mul(two, hn::Sub(hn::Set(d, kLogTwo), rest));
    const Vec density = hn::NegMulAdd(hn::Mul(noise, noise), hn::Set(d, Real(0.5)),
                                      hn::Neg(hn::Add(log_sigma, hn::Set(d, kHalfLogTwoPi))));
    store(sigma, deviation);
    store(hn::CopySign(hn::Div(hn::Sub(one, e), hn::Add(one, e)), u), action);
    store(hn::Sub(density, slope), log_prob);
  });
}

Real SquaredNorm(std::span<const Real> x) {
  return SumVectors(x.size(), [&](size_t i, size_t count, auto partial) HWY_ATTR {
    const Vec value = Load<partial.value>(x.data() + i, count);
    return hn::Mul(value, value);
  });
}

void AdamPolyakStep(const AdamConstants& constants, std::span<const Real> g, std::span<Real> m,
                    std::span<Real> v, std::span<Real> p, std::span<Real> target) {
  const Tag d;
  const Vec beta1 = hn::Set(d, constants.beta1);
  const Vec beta2 = hn::Set(d, constants.beta2);
  const Vec rest1 = hn::Set(d, Real{1} - constants.beta1);
  const Vec rest2 = hn::Set(d, Real{1} - constants.beta2);
  const Vec scale = hn::Set(d, constants.scale);
  const Vec step = hn::Set(d, constants.step);
  const Vec epsilon = hn::Set(d, constants.epsilon);
  const Vec tau = hn::Set(d, constants.tau);
  const Vec least = hn::Set(d, kLeastMoment);
  const auto or_zero = [least](Vec moment) HWY_ATTR {
    return hn::IfThenElseZero(hn::Ge(hn::Abs(moment), least), moment);
  };
  ForVectors(g.size(), [&](size_t i, size_t count, auto partial) HWY_ATTR {
    const auto load = [&](auto values)
                          HWY_ATTR { return Load<partial.value>(values.data() + i, count); };
    const auto store = [&](Vec value, std::span<Real> to)
                           HWY_ATTR { Store<partial.value>(value, to.data() + i, count); };
    const Vec gradient = hn::Mul(load(g), scale);
    const Vec m_new = or_zero(hn::MulAdd(beta1, load(m), hn::Mul(rest1, gradient)));
    const Vec v_new =
        or_zero(hn::MulAdd(beta2, load(v), hn::Mul(rest2, hn::Mul(gradient, gradient))));
    const Vec move = hn::Div(hn::Mul(step, m_new), hn::Add(hn::Sqrt(v_new), epsilon));
    const Vec p_new = hn::Sub(load(p), move);
    store(m_new, m);
    store(v_new, v);
    store(p_new, p);
    if (target.empty()) return;
    const Vec old_target = load(target);
    store(hn::MulAdd(tau, hn::Sub(p_new, old_target), old_target), target);
  });
}

}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace upswing {
HWY_EXPORT(Transpose);
HWY_EXPORT(LayerNormForward);
HWY_EXPORT(LayerNormBackwardInput);
HWY_EXPORT(LayerNormBackwardGain);
HWY_EXPORT(Tanh);
HWY_EXPORT(TanhBackward);
HWY_EXPORT(SquashSamples);
HWY_EXPORT(SquaredNorm);
HWY_EXPORT(AdamPolyakStep);

void LinearForward(Matrix<const Real> x, Matrix<const Real> w, std::span<const Real> b, bool relu,
                   Matrix<Real> y) {
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

void LinearBackwardInput(Matrix<const Real> dy, Matrix<const Real> w_transposed,
                         Matrix<const Real> gate, Matrix<Real> dx) {
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

void LinearBackwardWeight(Matrix<const Real> x, Matrix<const Real> dy, Matrix<Real> dw,
                          std::span<Real> db) {
  constexpr int kFewColumns = 4, kPart = 64;
  if (dw.cols() <= kFewColumns) {
    // Compute a few columns as their transpose, rows that fill registers. The sums are the same.
    Real rows[kFewColumns * kPart];
    for (int first = 0; first < dw.rows(); first += kPart) {
      const int count = std::min(kPart, dw.rows() - first);
      const Matrix<Real> transposed(rows, dw.cols(), count);
      Multiply({.M = dw.cols(),
                .N = count,
                .K = x.rows(),
                .a = dy.data(),
                .a_m = 1,
                .a_k = dy.stride(),
                .b = x.Cols(first, count),
                .c = transposed});
      Transpose(transposed, dw.Rows(first, count));
    }
    if (!db.empty()) SumRows(dy, db);
    return;
  }
  Multiply({.M = dw.rows(),
            .N = dw.cols(),
            .K = x.rows(),
            .a = x.data(),
            .a_m = 1,
            .a_k = x.stride(),
            .b = dy,
            .c = dw,
            .b_sum = db});
}

void Transpose(Matrix<const Real> x, Matrix<Real> y) { HWY_DYNAMIC_DISPATCH(Transpose)(x, y); }

void SumRows(Matrix<const Real> x, std::span<Real> sum) {
  // The gradient of the weights of an input that is always 1.
  const Real one = 1;
  LinearBackwardWeight({&one, x.rows(), 1, 0}, x, {sum.data(), 1, x.cols()});
}

void LayerNormForward(Matrix<Real> x, std::span<const Real> gain, std::span<const Real> bias,
                      std::span<Real> inv_std, bool relu, Matrix<Real> y) {
  HWY_DYNAMIC_DISPATCH(LayerNormForward)(x, gain, bias, inv_std, relu, y);
}

void LayerNormBackwardInput(Matrix<const Real> x_hat, std::span<const Real> gain,
                            std::span<const Real> inv_std, Matrix<const Real> dy, Matrix<Real> dx) {
  HWY_DYNAMIC_DISPATCH(LayerNormBackwardInput)(x_hat, gain, inv_std, dy, dx);
}

void LayerNormBackwardGain(Matrix<const Real> x_hat, Matrix<const Real> dy, std::span<Real> dgain) {
  HWY_DYNAMIC_DISPATCH(LayerNormBackwardGain)(x_hat, dy, dgain);
}

void Tanh(std::span<Real> x) { HWY_DYNAMIC_DISPATCH(Tanh)(x); }

void TanhBackward(std::span<const Real> y, std::span<Real> dy) {
  HWY_DYNAMIC_DISPATCH(TanhBackward)(y, dy);
}

void SquashSamples(std::span<const Real> mean, std::span<const Real> log_std,
                   std::span<const Real> epsilon, std::span<Real> deviation, std::span<Real> action,
                   std::span<Real> log_prob) {
  HWY_DYNAMIC_DISPATCH(SquashSamples)(mean, log_std, epsilon, deviation, action, log_prob);
}

Real SquaredNorm(std::span<const Real> x) { return HWY_DYNAMIC_DISPATCH(SquaredNorm)(x); }

void AdamPolyakStep(const AdamConstants& constants, std::span<const Real> g, std::span<Real> m,
                    std::span<Real> v, std::span<Real> p, std::span<Real> target) {
  HWY_DYNAMIC_DISPATCH(AdamPolyakStep)(constants, g, m, v, p, target);
}

}  // namespace upswing
#endif  // HWY_ONCE
