#pragma once

#include <Eigen/Core>
#include <array>

#include "extras/machine/logs/log.h"
#include "extras/machine/logs/windows.h"
#include "extras/machine/twin/motion.h"
#include "extras/machine/twin/twin.h"

/// The residuals of a window of a log, with their derivatives: what a fit sums.
namespace upswing::machine {

/// Number of constants: those of the motion without the start, zeros, current_delay and
/// current_inertia.
inline constexpr int kConstants = kTangents - 4 + 4;
using Constants = Eigen::Matrix<double, kConstants, 1>;
using ConstantsMatrix = Eigen::Matrix<double, kConstants, kConstants>;

/// The constants of a twin: its equations of motion, times of the motors, and zeros.
Constants ConstantsOf(const Twin& twin);

/// The mean of a window's squared residuals over its rows, angles or torques, and its derivatives
/// by start state and constants.
struct SquaredResiduals {
  double mean = 0;                                                     // rad² or (N·m)²
  Eigen::Matrix<double, 4 + kConstants, 4 + kConstants> H = H.Zero();  // half of the second one
  Eigen::Matrix<double, 4 + kConstants, 1> g = g.Zero();               // half of the first one
};

/// The residuals of a window.
struct WindowResiduals {
  SquaredResiduals angle, torque;
};

/// The residuals of a window from the start state x (rad, rad, rad/s, rad/s), predicted minus
/// measured. `reported`: whether the joints report torques. Derivatives are zero unless
/// `linearizes`.
WindowResiduals ResidualsOf(const MachineLog& log, const LogWindow& window,
                            const std::array<bool, 2>& reported, const Eigen::Vector4d& x,
                            const Twin& twin, const Drive& drive, bool linearizes);

}  // namespace upswing::machine
