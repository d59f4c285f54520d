// Symbols A, G, H of each doubling as in Chu, Fan, Lin, Wang (2004).
#include "control/riccati.h"

#include <cmath>
#include <limits>

namespace upswing {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector4d;

constexpr int kMostDoublings = 60;         // k of them span 2^k control steps
constexpr double kLargestResidual = 1e-6;  // above it, rounding has ruined the solution

Matrix4d Symmetric(const Matrix4d& X) { return (X + X.transpose()) / 2; }

/// W⁻¹ X, by Gaussian elimination with partial pivoting.
Matrix4d Solve(Matrix4d W, Matrix4d X) {
  for (int k = 0; k < 4; ++k) {
    int pivot = k;
    for (int i = k + 1; i < 4; ++i) {
      if (std::abs(W(i, k)) > std::abs(W(pivot, k))) pivot = i;
    }
    W.row(k).swap(W.row(pivot));
    X.row(k).swap(X.row(pivot));
    for (int i = k + 1; i < 4; ++i) {
      const double factor = W(i, k) / W(k, k);
      W.row(i) -= factor * W.row(k);
      X.row(i) -= factor * X.row(k);
    }
  }
  for (int k = 3; k >= 0; --k) {
    for (int j = k + 1; j < 4; ++j) X.row(k) -= W(k, j) * X.row(j);
    X.row(k) /= W(k, k);
  }
  return X;
}

/// The limit of H, or nothing if there is none. After k doublings, H is the smallest cost of 2^k
/// steps without a final cost.
std::optional<Matrix4d> Doubled(Matrix4d A, Matrix4d G, Matrix4d H) {
  for (int k = 0; k < kMostDoublings; ++k) {
    const Matrix4d W = Matrix4d::Identity() + G * H;
    const Matrix4d WA = Solve(W, A);
    const Matrix4d longer = A.transpose() * H * WA;
    G += Symmetric(A * Solve(W, G) * A.transpose());
    H += Symmetric(longer);
    A = (A * WA).eval();
    if (!H.allFinite() || !G.allFinite()) return std::nullopt;
    if (longer.norm() <= std::numeric_limits<double>::epsilon() * H.norm()) break;
  }
  return H;
}

}  // namespace

std::optional<Lqr> SolveDiscreteLqr(const LinearModel& model, const Matrix4d& Q, double R) {
  const auto& [A, B] = model;
  const auto P = Doubled(A, B * B.transpose() / R, Q);
  if (!P) return std::nullopt;
  const Eigen::RowVector4d K = B.transpose() * *P * A / (R + B.dot(*P * B));
  const Matrix4d right = Q + A.transpose() * *P * (A - B * K);
  const bool solved = (right - *P).norm() <= kLargestResidual * P->norm();
  if (!solved || !(SpectralRadius(A - B * K) < 1)) return std::nullopt;
  return Lqr{K, *P};
}

double SpectralRadius(const Matrix4d& A) {
  // Gelfand's formula, ‖Aⁿ‖^(1/n) with n = 2^k. Each squaring divides the power by its norm and
  // sums the norms' logarithms.
  constexpr int kSquarings = 55;  // after these, 1/n is below the rounding error
  Matrix4d power = A;
  double logarithm = 0, share = 1;
  for (int k = 0; k < kSquarings; ++k, share /= 2) {
    const double size = power.norm();
    if (size == 0) return 0;
    power /= size;
    logarithm += share * std::log(size);
    power = (power * power).eval();
  }
  return std::exp(logarithm);
}

SymmetricModes SymmetricModesOf(Matrix4d S) {
  constexpr int kSweeps = 30;
  Matrix4d V = Matrix4d::Identity();
  bool rotated = true;
  for (int sweep = 0; sweep < kSweeps && rotated; ++sweep) {
    rotated = false;
    for (int p = 0; p < 4; ++p) {
      for (int q = p + 1; q < 4; ++q) {
        if (std::abs(S(p, q)) <= 1e-18 * std::sqrt(std::abs(S(p, p) * S(q, q)))) continue;
        const double theta = (S(q, q) - S(p, p)) / (2 * S(p, q));
        const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::hypot(theta, 1));
        const double c = 1 / std::hypot(t, 1), s = t * c;
        const auto rotate = [&](auto&& one, auto&& two) {
          const Vector4d before = one;
          one = c * before - s * two;
          two = s * before + c * two;
        };
        rotate(S.col(p), S.col(q));
        rotate(S.row(p).transpose(), S.row(q).transpose());
        rotate(V.col(p), V.col(q));
        S(p, q) = S(q, p) = 0;  // drop the rounding error
        rotated = true;
      }
    }
  }
  return {V, S.diagonal()};
}

}  // namespace upswing
