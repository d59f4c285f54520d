// How many steps of the physics a plan needs.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/rng.h"
#include "control/pendulum_model.h"

namespace upswing {
namespace {

/// Random states within `range` of upright (rad, rad/s), each with a torque up to `torque` (N·m).
struct PlannedStates {
  std::vector<StateVector> x;
  std::vector<double> u;

  PlannedStates(const StateVector& range, double torque) {
    constexpr int kStates = 1000;
    Rng rng(0, "states of planned motions");
    for (int i = 0; i < kStates; ++i) {
      StateVector state(std::numbers::pi, 0, 0, 0);
      for (int k = 0; k < 4; ++k) state[k] += rng.Uniform(-range[k], range[k]);
      x.push_back(state);
      u.push_back(rng.Uniform(-torque, torque));
    }
  }

  /// The states after a control period of this many steps.
  std::vector<StateVector> After(const DesignPlant& plant, int steps) const {
    std::vector<StateVector> after = x;
    PendulumModel(plant, steps).Step(after, u);
    return after;
  }
};

}  // namespace

int PlanningSteps(const DesignPlant& plant) {
  constexpr double kTolerance = 3e-3;  // rms error of a control period, rad and natural velocity
  const double velocity = TaskScaleOf(plant).velocity();
  const StateVector unit(1, 1, velocity, velocity);
  const int most = plant.physics_steps();
  const auto error_of = [&](int steps, const PlannedStates& states) {
    const std::vector<StateVector> x = states.After(plant, steps),
                                   exact = states.After(plant, most);
    double squares = 0;
    for (size_t i = 0; i < x.size(); ++i) {
      squares += (x[i] - exact[i]).cwiseQuotient(unit).squaredNorm();
    }
    return std::sqrt(squares / static_cast<double>(x.size()));
  };
  constexpr double kPi = std::numbers::pi, kNear = 0.02;  // rad
  const PlannedStates swinging({kPi, kPi, 10 * velocity, 20 * velocity}, plant.torque_limit);
  // Dry friction is steepest near rest, where a plan holds the links.
  const PlannedStates held({kNear, kNear, kNear * velocity, kNear * velocity}, 0);
  int steps = 1;
  while (steps < most && std::max(error_of(steps, swinging), error_of(steps, held)) > kTolerance) {
    steps *= 2;
  }
  return steps;
}

}  // namespace upswing
