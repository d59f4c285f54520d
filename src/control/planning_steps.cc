// How many steps of the physics a plan needs.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/rng.h"
#include "control/pendulum_model.h"

namespace upswing {
namespace {

/// Motions of a control period from random states within `range` of upright (rad, rad/s), each
/// under a torque up to `torque` (N·m).
class PlannedMotions {
 public:
  PlannedMotions(const DesignPlant& plant, const StateVector& range, double torque)
      : plant_(plant) {
    constexpr int kMotions = 1000;
    Rng rng(0, "states of planned motions");
    for (int i = 0; i < kMotions; ++i) {
      StateVector state(std::numbers::pi, 0, 0, 0);
      for (int k = 0; k < 4; ++k) state[k] += rng.Uniform(-range[k], range[k]);
      begin_.push_back(state);
      torque_.push_back(rng.Uniform(-torque, torque));
    }
    simulated_ = EndsWith(plant.physics_steps());
  }

  /// Error of this many Runge-Kutta steps against the simulation: rms, in rad and natural velocity.
  double ErrorOf(int steps) const {
    const double velocity = TaskScaleOf(plant_).velocity();
    const StateVector unit(1, 1, velocity, velocity);
    const std::vector<StateVector> planned = EndsWith(steps);
    double squares = 0;
    for (size_t i = 0; i < planned.size(); ++i) {
      squares += (planned[i] - simulated_[i]).cwiseQuotient(unit).squaredNorm();
    }
    return std::sqrt(squares / static_cast<double>(planned.size()));
  }

 private:
  std::vector<StateVector> EndsWith(int steps) const {
    std::vector<StateVector> end = begin_;
    PendulumModel(plant_, steps).Step(end, torque_);
    return end;
  }

  const DesignPlant& plant_;
  std::vector<StateVector> begin_, simulated_;
  std::vector<double> torque_;
};

}  // namespace

int PlanningSteps(const DesignPlant& plant) {
  constexpr double kTolerance = 3e-3;  // largest rms error of a period, rad and natural velocity
  constexpr double kPi = std::numbers::pi, kNear = 0.02;  // rad
  const double velocity = TaskScaleOf(plant).velocity();
  const int most = plant.physics_steps();
  if (most == 1) return 1;
  const PlannedMotions swinging(plant, {kPi, kPi, 10 * velocity, 20 * velocity},
                                plant.torque_limit);
  // Dry friction is steepest near rest, where a plan holds the links.
  const PlannedMotions held(plant, {kNear, kNear, kNear * velocity, kNear * velocity}, 0);
  int steps = 1;
  while (steps < most && std::max(swinging.ErrorOf(steps), held.ErrorOf(steps)) > kTolerance) {
    steps *= 2;
  }
  return steps;
}

}  // namespace upswing
