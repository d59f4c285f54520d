#pragma once

#include <Eigen/Core>
#include <array>

#include "extras/machine/logs/log.h"
#include "extras/machine/logs/windows.h"
#include "extras/machine/twin/motion.h"
#include "extras/machine/twin/twin.h"

/// The residuals of a window of a log, with their derivatives: what a fit sums.
namespace upswing::machine {

/// Rows of the constants that residuals depend on besides the start state: those of the motion,
/// zeros, current_delay, current_inertia, offsets of torques, and the coefficients of cogging.
namespace constant {
enum Row {
  kBody = 0,
  kDelay = kBody + kNumManipulatorConstants,
  kLag,
  kZero1,
  kZero2,
  kCurrentDelay,
  kCurrentInertia,
  kOffset,
  kCogging = kOffset + 2,
  kRows = kCogging + 2 * Cogging::kCoefficients,
};
}
inline constexpr int kMostConstants = constant::kRows;
/// Number of constants of a detail.
int NumConstants(Detail detail);

/// The constants of a twin (NumConstants): its equations of motion, times of the motors, zeros,
/// offsets of torques, and cogging.
Eigen::VectorXd ConstantsOf(const Twin& twin, Detail detail);

/// The mean of a window's squared residuals over its rows, angles or torques, and its derivatives
/// by start state and constants.
struct SquaredResiduals {
  double mean = 0;    // rad² or (N·m)²
  Eigen::MatrixXd H;  // half of the second one, n = 4 + constants; empty without derivatives
  Eigen::VectorXd g;  // half of the first one
};

/// The residuals of a window.
struct WindowResiduals {
  SquaredResiduals angle, torque;
};

/// A log, which must outlive this, and a twin as its model.
struct ModelledLog {
  ModelledLog(const MachineLog& of, const Twin& twin);
  /// `detail`: of the derivatives.
  ModelledLog(const MachineLog& of, const Twin& twin, Detail detail);

  const MachineLog& log;
  std::array<bool, 2> reported;  // whether the joints report torques
  Actuator motor;
  MotionModel model;
};

/// The residuals of a window of the log from the start state x (rad, rad, rad/s, rad/s), predicted
/// minus measured. Derivatives are empty unless `linearizes`.
WindowResiduals ResidualsOf(const ModelledLog& modelled, const LogWindow& window,
                            const Eigen::Vector4d& x, bool linearizes);

}  // namespace upswing::machine
