#pragma once

#include <Eigen/Core>
#include <span>

#include "control/linearize.h"
#include "sim/closed_form.h"
#include "sim/double_pendulum.h"

/// The double pendulum as trajectory optimisation wants it: a step and its derivatives.
namespace upswing {

/// [q1, q2, w1, w2]: rad and rad/s.
using StateVector = Eigen::Vector4d;
inline PendulumState StateOf(const StateVector& x) { return {x[0], x[1], x[2], x[3]}; }

/// x⁺ = f(x, u): one control period with the torque u (N·m) held, by the very kernels of the
/// simulation, of many states at once.
class PendulumModel {
 public:
  explicit PendulumModel(const Plant& plant) : plant_(plant), few_(0), many_(0) {}

  const Plant& plant() const { return plant_; }

  /// Steps states (n) in place, each under its torque (n). The torque is not limited.
  void Step(std::span<StateVector> x, std::span<const double> u);

  /// A = ∂f/∂x and B = ∂f/∂u at each of n points, by central differences: all 10 n steps are one
  /// batch. They are exact to about 1e-9 of their size.
  void Linearize(std::span<const StateVector> x, std::span<const double> u,
                 std::span<LinearModel> models);

 private:
  /// Room for n pendulums.
  void Reserve(ClosedFormBatch& batch, size_t n) const;

  Plant plant_;
  ClosedFormBatch few_, many_;  // those of Step and of Linearize
};

}  // namespace upswing
