// The symbols are those of Chu, Fan, Lin, Wang (2004): A, G, H of each doubling.
#include "control/riccati.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <limits>

namespace upswing {

using Eigen::MatrixXd;

namespace {

constexpr int kMostDoublings = 60;         // k of them span 2^k control steps
constexpr double kLeastControl = 1e-9;     // see IsStabilizable
constexpr double kLargestResidual = 1e-6;  // beyond it rounding has eaten the solution

MatrixXd Symmetric(const MatrixXd& X) { return (X + X.transpose()) / 2; }

}  // namespace

bool IsStabilizable(const MatrixXd& A, const MatrixXd& B) {
  const Eigen::Index n = A.rows();
  const Eigen::VectorXcd modes = A.eigenvalues();
  for (Eigen::Index i = 0; i < n; ++i) {
    if (std::abs(modes[i]) < 1) continue;
    // a + bi as the real matrix [a, -b; b, a], which has its singular values, each twice.
    const MatrixXd I = MatrixXd::Identity(n, n), zero = MatrixXd::Zero(n, B.cols());
    MatrixXd pencil(2 * n, 2 * (n + B.cols()));
    pencil << modes[i].real() * I - A, -modes[i].imag() * I, B, zero,  //
        modes[i].imag() * I, modes[i].real() * I - A, zero, B;
    const Eigen::VectorXd sizes = pencil.jacobiSvd().singularValues();
    if (!(sizes.minCoeff() > kLeastControl * sizes.maxCoeff())) return false;
  }
  return true;
}

std::optional<MatrixXd> SolveRiccati(const MatrixXd& A, const MatrixXd& B, const MatrixXd& Q,
                                     const MatrixXd& R) {
  if (!IsStabilizable(A, B)) return std::nullopt;
  const MatrixXd I = MatrixXd::Identity(A.rows(), A.cols());
  MatrixXd A_k = A;
  MatrixXd G = B * R.llt().solve(B.transpose());
  MatrixXd H = Q;  // after k doublings the least cost of 2^k steps, without a cost of their end
  for (int k = 0; k < kMostDoublings; ++k) {
    const Eigen::PartialPivLU<MatrixXd> W(I + G * H);
    const MatrixXd WA = W.solve(A_k);
    const MatrixXd longer = A_k.transpose() * H * WA;
    G += Symmetric(A_k * W.solve(G) * A_k.transpose());
    H += Symmetric(longer);
    A_k = A_k * WA;
    if (!H.allFinite() || !G.allFinite()) return std::nullopt;
    if (longer.norm() <= std::numeric_limits<double>::epsilon() * H.norm()) break;
  }
  const bool solved = RiccatiResidual(H, A, B, Q, R) <= kLargestResidual;
  if (!solved || SpectralRadius(A - B * GainOf(H, A, B, R)) >= 1) return std::nullopt;
  return H;
}

MatrixXd GainOf(const MatrixXd& P, const MatrixXd& A, const MatrixXd& B, const MatrixXd& R) {
  return (R + B.transpose() * P * B).llt().solve(B.transpose() * P * A);
}

double SpectralRadius(const MatrixXd& A) { return A.eigenvalues().cwiseAbs().maxCoeff(); }

double RiccatiResidual(const MatrixXd& P, const MatrixXd& A, const MatrixXd& B, const MatrixXd& Q,
                       const MatrixXd& R) {
  const MatrixXd right = Q + A.transpose() * P * (A - B * GainOf(P, A, B, R));
  const double size = P.norm();
  return size > 0 ? (right - P).norm() / size : (right - P).norm();
}

}  // namespace upswing
