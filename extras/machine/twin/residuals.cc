#include "extras/machine/twin/residuals.h"

namespace upswing::machine {

Constants ConstantsOf(const Twin& twin) {
  const Manipulator m = BodyOf(twin);
  const Actuator& motor = twin.actuator;
  Constants c;
  c << m.J1, m.J2, m.b, m.a, m.G1, m.G2, m.d1, m.d2, m.f1, m.f2, motor.delay, motor.lag,
      twin.sensors.zero1, twin.sensors.zero2, motor.current_delay, motor.current_inertia;
  return c;
}

WindowResiduals ResidualsOf(const MachineLog& log, const LogWindow& window,
                            const std::array<bool, 2>& reported, const Eigen::Vector4d& x,
                            const Twin& twin, const Drive& drive, bool linearizes) {
  const int first = window.first, last = window.last;
  const Actuator& motor = twin.actuator;
  Motion motion;
  MotionTangents tangents;
  Predict(BodyOf(twin), drive, {twin.sensors.zero1, twin.sensors.zero2}, {x(0), x(1), x(2), x(3)},
          log, first, last, motor.current_delay, motion, linearizes ? &tangents : nullptr);
  const int rows = last - first;
  WindowResiduals residuals;
  Eigen::Matrix<double, 4 + kConstants, Eigen::Dynamic> J(4 + kConstants,
                                                          linearizes ? 2 * rows : 0);
  Eigen::VectorXd r = Eigen::VectorXd::Zero(2 * rows);
  const auto square = [&](SquaredResiduals& s) {
    s.mean = r.squaredNorm() / rows;
    if (!linearizes) return;
    s.H = J * J.transpose() / rows;
    s.g = J * r / rows;
  };
  for (int k = 0; k < rows; ++k) {
    for (int j = 0; j < 2; ++j) {
      const int i = 2 * k + j;
      r(i) = motion.angle[k][j] - log.angle[first + k][j];
      if (!linearizes) continue;
      J.col(i) << tangents.angle.col(i), -tangents.angle(0, i), -tangents.angle(1, i), 0, 0;
      J(kTangents + j, i) += 1;
    }
  }
  square(residuals.angle);
  if (log.measured.empty()) return residuals;
  int cursor = 0;
  r.setZero();
  if (linearizes) J.setZero();
  for (int k = 0; k < rows; ++k) {
    DriveTangents of_torque;
    const double time = log.time[first + k] - motor.current_delay;
    const Joints torque = drive.At(time, cursor, linearizes ? &of_torque : nullptr);
    for (int j = 0; j < 2; ++j) {
      if (!reported[j]) continue;
      const int i = 2 * k + j;
      r(i) = torque[j] - motor.current_inertia * motion.acceleration[k][j] -
             log.measured[first + k][j];
      if (!linearizes) continue;
      const Eigen::Matrix<double, kTangents, 1> slope =
          -motor.current_inertia * tangents.acceleration.col(i);
      J.col(i) << slope, -slope(0), -slope(1),
          of_torque.by_delay[j] + motor.current_inertia * tangents.jerk[k][j],
          -motion.acceleration[k][j];
      J(kTangents - 2, i) += of_torque.by_delay[j];
      J(kTangents - 1, i) += of_torque.by_lag[j];
    }
  }
  square(residuals.torque);
  return residuals;
}

}  // namespace upswing::machine
