// Symbols as in sim/closed_form.h: J inertias, b coupling of the links (kg·m²), G moments of
// gravity (N·m), d damping (N·m·s/rad).
#include "control/linearize.h"

#include <Eigen/LU>

#include "sim/closed_form.h"

namespace upswing {

LinearModel LinearizeUpright(const Plant& plant) {
  ClosedFormBatch batch(1);
  batch.SetPlant(0, plant);
  const double J1 = batch.J1[0], J2 = batch.J2[0], b = batch.b[0];
  const double G1 = batch.G1[0], G2 = batch.G2[0], d1 = batch.d1[0], d2 = batch.d2[0];

  // M q̈ = e u + G q - D q̇, e the motor's joint. With cos q2 = 1 nothing of M is lost; gravity,
  // which pulls back hanging, pushes away; what is quadratic in the velocities has no part.
  Eigen::Matrix2d M, G, D;
  M << J1 + J2 + 2 * b, J2 + b, J2 + b, J2 + kArmature;
  G << G1 + G2, G2, G2, G2;
  D << d1, 0, 0, d2;
  const Eigen::Matrix2d inverse = M.inverse();

  LinearModel model;
  model.A << Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Identity(), inverse * G, -inverse * D;
  model.B << 0, 0, inverse.col(plant.actuated_joint == 1 ? 0 : 1);
  return model;
}

LinearModel Discretize(const LinearModel& continuous, double h, int steps) {
  // Of [x, u] with u held, hence linear without an input. A Runge-Kutta step is then the beginning
  // of the exponential's series: 1 + Z + Z²/2 + Z³/6 + Z⁴/24, with Z the system's matrix times h.
  using Matrix5d = Eigen::Matrix<double, 5, 5>;
  const Matrix5d one = Matrix5d::Identity();
  Matrix5d Z = Matrix5d::Zero();
  Z.topLeftCorner<4, 4>() = h * continuous.A;
  Z.topRightCorner<4, 1>() = h * continuous.B;
  const Matrix5d step = one + Z * (one + Z / 2 * (one + Z / 3 * (one + Z / 4)));
  Matrix5d all = one;
  for (int i = 0; i < steps; ++i) all = step * all;
  return {all.topLeftCorner<4, 4>(), all.topRightCorner<4, 1>()};
}

}  // namespace upswing
