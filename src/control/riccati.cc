// Symbols A, G, H of each doubling as in Chu, Fan, Lin, Wang (2004).
#include "control/riccati.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace upswing {
namespace {

using Eigen::Matrix4d;

constexpr int kMostDoublings = 60;         // k of them span 2^k control steps
constexpr double kLargestResidual = 1e-6;  // above it, rounding has ruined the solution

Matrix4d Symmetric(const Matrix4d& X) { return (X + X.transpose()) / 2; }

/// The limit of H, or nothing if there is none. After k doublings, H is the smallest cost of 2^k
/// steps without a final cost.
std::optional<Matrix4d> Doubled(Matrix4d A, Matrix4d G, Matrix4d H) {
  for (int k = 0; k < kMostDoublings; ++k) {
    const Matrix4d W = Matrix4d::Identity() + G * H;
    const Eigen::PartialPivLU<Matrix4d> inverse(W);
    const Matrix4d WA = inverse.solve(A);
    const Matrix4d longer = A.transpose() * H * WA;
    G += Symmetric(A * inverse.solve(G) * A.transpose());
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

double SpectralRadius(const Eigen::MatrixXd& A) {
  // Gelfand's formula, ‖Aⁿ‖^(1/n) with n = 2^k, because Eigen's solver would add 22 kB to the page.
  // Each squaring divides the power by its norm and sums the norms' logarithms.
  constexpr int kSquarings = 55;  // after these, 1/n is below the rounding error
  Eigen::MatrixXd power = A;
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

}  // namespace upswing
