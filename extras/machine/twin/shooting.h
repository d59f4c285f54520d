#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "base/thread_pool.h"
#include "extras/machine/logs/log.h"
#include "extras/machine/logs/windows.h"
#include "extras/machine/twin/fit_parameters.h"
#include "extras/machine/twin/residuals.h"

/// The model of an identification by multiple shooting: from θ and the start states of all windows
/// to residuals, their cost, and their derivatives.
namespace upswing::machine {

/// What an identification searches.
struct FitPoint {
  Eigen::VectorXd theta;                // (n)
  std::vector<Eigen::Vector4d> starts;  // (windows) start states: rad, rad, rad/s, rad/s
};

/// Scales s of the robust cost ln(1 + r²/s²), where r² is a window's mean squared residual.
struct RobustScales {
  double angle = 0.1;  // rad
  double torque = 1;   // N·m
};

/// A window's part of the Gauss-Newton equations H Δ = -g, by start state x and constants c.
struct WindowBlock {
  Eigen::Matrix4d Hxx;
  Eigen::Vector4d gx;
  Eigen::Matrix<double, 4, Eigen::Dynamic> Hxc;
  Eigen::MatrixXd Hcc;
  Eigen::VectorXd gc;
};

/// The windows of logs, in the order of the logs.
class ShootingModel {
 public:
  /// Cuts the logs into windows; `logs` and `parameters` must outlive the model.
  ShootingModel(std::span<const MachineLog> logs, const FitParameters& parameters,
                const WindowRules& rules, ThreadPool* pool);

  const FitParameters& parameters() const { return parameters_; }
  int windows() const { return static_cast<int>(windows_.size()); }
  /// Index of a window's log, and of its session.
  int LogOfWindow(int window) const { return windows_[window].log; }
  int SessionOfWindow(int window) const {
    return parameters_.sessions().of_log[LogOfWindow(window)];
  }
  /// The sessions with windows, in ascending order.
  std::vector<int> SeenSessions() const;

  /// The first guess, with the start states of the windows' cubics.
  FitPoint FirstPoint() const;

  /// The residuals of all windows. Derivatives are zero.
  std::vector<WindowResiduals> Residuals(const FitPoint& point) const;
  /// The residuals of all windows with their derivatives.
  std::vector<WindowResiduals> Linearize(const FitPoint& point) const;

  /// The median errors as scales of the robust cost, within limits.
  RobustScales ScalesOf(const std::vector<WindowResiduals>& residuals) const;
  /// The windows' part of the cost: the robust cost of their residuals, and a prior of the start
  /// states about their cubics.
  double Cost(const std::vector<WindowResiduals>& residuals, const FitPoint& point,
              const RobustScales& scales) const;
  /// Half of its derivatives. The robust cost weighs squares by 1 / (s² + r²).
  std::vector<WindowBlock> Blocks(const std::vector<WindowResiduals>& linearized,
                                  const FitPoint& point, const RobustScales& scales) const;

 private:
  std::vector<WindowResiduals> ResidualsAt(const FitPoint& point, bool linearizes) const;

  std::span<const MachineLog> logs_;
  const FitParameters& parameters_;
  ThreadPool* pool_;
  std::vector<LogWindow> windows_;
  std::vector<Eigen::Vector4d> cubics_;  // (windows) start states
};

/// Median over the windows of the root mean square of their residuals of angles (rad).
double MedianAngleError(const std::vector<WindowResiduals>& residuals);

}  // namespace upswing::machine
