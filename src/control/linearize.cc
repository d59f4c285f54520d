#include "control/linearize.h"

namespace upswing {

LinearModel LinearizeUpright(const Manipulator& plant, int actuated_joint) {
  // M q̈ = e u + G q - D q̇, with e the motor's joint. M keeps all terms with cos q2 = 1. Gravity,
  // which pulls back when hanging, pushes away here. Terms quadratic in the velocities vanish.
  Eigen::Matrix2d inverse, G, D;
  const auto [M11, M12, M22] = plant.Mass(1);
  inverse << M22, -M12, -M12, M11;
  inverse /= plant.Mass(1).det();
  G << plant.G1 + plant.G2, plant.G2, plant.G2, plant.G2;
  D << plant.d1, 0, 0, plant.d2;

  LinearModel model;
  model.A << Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Identity(), inverse * G, -inverse * D;
  model.B << 0, 0, inverse.col(actuated_joint - 1);
  return model;
}

LinearModel LinearizeUpright(const Plant& plant) {
  return LinearizeUpright(ManipulatorOf(plant), static_cast<int>(plant.actuated_joint));
}

LinearModel Discretize(const LinearModel& continuous, double h, int steps) {
  // [x, u] with u held is a linear system without an input. A Runge-Kutta step is then the start of
  // the exponential series: 1 + Z + Z²/2 + Z³/6 + Z⁴/24, with Z the system's matrix times h.
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
