#include "realaigym/linear.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "core/error.h"

namespace upswing {

BoardLinear LinearizeUpright(const BoardPlant& p, Robot robot) {
  BoardBlock block;
  block.SetPlant(0, p);
  const double A = block.A[0], b = block.b[0], C = block.C[0];
  const double G1 = block.G1[0], G2 = block.G2[0];
  Eigen::Matrix2d M, G, D;
  M << A + 2 * b, C + b, C + b, block.D[0];
  G << G1 + G2, G2, G2, G2;
  D << p.damping1, 0, 0, p.damping2;
  const Eigen::Matrix2d inverse = M.inverse();
  BoardLinear model;
  model.A << Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Identity(), inverse * G, -inverse * D;
  model.B << 0, 0, inverse.col(robot == Robot::kPendubot ? 0 : 1);
  return model;
}

BoardRegulator SolveBoardRegulator(const BoardLinear& model, const Eigen::Vector4d& Q, double R) {
  // P = Y X⁻¹ of the stable eigenvectors [X; Y] of the Hamiltonian matrix: Laub, "A Schur method
  // for solving algebraic Riccati equations" (1979), with eigenvectors in place of Schur's.
  Eigen::Matrix<double, 8, 8> H;
  H << model.A, -model.B * model.B.transpose() / R, -Eigen::Matrix4d(Q.asDiagonal()),
      -model.A.transpose();
  const Eigen::EigenSolver<Eigen::Matrix<double, 8, 8>> solver(H);
  Eigen::Matrix<std::complex<double>, 8, 4> stable;
  Eigen::Index found = 0;
  for (Eigen::Index i = 0; i < 8; ++i) {
    if (solver.eigenvalues()[i].real() >= 0) continue;
    if (found < 4) stable.col(found) = solver.eigenvectors().col(i);
    ++found;
  }
  if (found != 4) throw BadInput("realaigym: no gain holds this plant upright");
  const Eigen::Matrix4cd X = stable.topRows<4>(), Y = stable.bottomRows<4>();
  const Eigen::Matrix4d P = (Y * X.inverse()).real();
  return {(model.B.transpose() * P / R), (P + P.transpose()) / 2};
}

}  // namespace upswing
