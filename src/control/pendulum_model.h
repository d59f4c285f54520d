#pragma once

#include <Eigen/Core>
#include <span>

#include "control/design_plant.h"
#include "control/linearize.h"
#include "pendulum/closed_form.h"
#include "pendulum/plant.h"

/// The double pendulum for trajectory optimisation: a step and its derivatives.
namespace upswing {

/// [q1, q2, w1, w2]: rad and rad/s.
using StateVector = Eigen::Vector4d;
inline PendulumState StateOf(const StateVector& x) { return {x[0], x[1], x[2], x[3]}; }

/// x⁺ = f(x, u): one control period of many states at once, with each torque u (N·m) held. Uses the
/// same kernels as the simulation.
class PendulumModel {
 public:
  explicit PendulumModel(const DesignPlant& plant) : PendulumModel(plant, plant.physics_steps()) {}
  /// `steps`: number of Runge-Kutta steps in a control period.
  PendulumModel(const DesignPlant& plant, int steps)
      : plant_(plant), scale_(TaskScaleOf(plant)), steps_(steps), batch_(0) {}

  const DesignPlant& plant() const { return plant_; }
  const Scale& scale() const { return scale_; }  // TaskScaleOf the plant

  /// Steps states (n) in place, each under its own torque (n). Does not limit the torque.
  void Step(std::span<StateVector> x, std::span<const double> u);

  /// A = ∂f/∂x and B = ∂f/∂u at each of n points, by central differences of one batch of 10 n
  /// steps. The relative error is about 1e-9.
  void Linearize(std::span<const StateVector> x, std::span<const double> u,
                 std::span<LinearModel> models);

 private:
  /// Makes room for n pendulums.
  void Reserve(size_t n);

  DesignPlant plant_;
  Scale scale_;
  int steps_;  // of the physics in a control period
  ClosedFormBatch batch_;
};

/// Number of Runge-Kutta steps in a control period for plans: the smallest power of 2 whose error
/// against the simulation is at most 0.003 (rad and natural velocity, rms over random states that
/// swing or are held). Plants with steep dry friction need more.
int PlanningSteps(const DesignPlant& plant);

}  // namespace upswing
