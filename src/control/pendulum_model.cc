#include "control/pendulum_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/rng.h"
#include "pendulum/timestep.h"

namespace upswing {
namespace {

/// Step of the central differences: rad, and rad/s and N·m in units of Scale. Truncation, of the
/// order of its square, and rounding, of the order of 1e-16 over it, are about equal.
constexpr double kDifference = 1e-5;
/// Perturbations of a point: both directions of four states and a torque.
constexpr size_t kPerturbed = 10;

void Set(ClosedFormBatch& batch, size_t i, const StateVector& x, double u) {
  batch.SetState(i, StateOf(x));
  batch.tau[i] = u;
}

StateVector Get(const ClosedFormBatch& batch, size_t i) {
  return {batch.q1[i], batch.q2[i], batch.w1[i], batch.w2[i]};
}

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

int DesignPlant::physics_steps() const {
  return PhysicsStepsFor(*this, control_period, "design plant");
}

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

void PendulumModel::Reserve(size_t n) {
  if (batch_.padded() >= n) return;
  batch_ = ClosedFormBatch(n);
  for (size_t i = 0; i < batch_.padded(); ++i) batch_.SetPlant(i, plant_);
}

void PendulumModel::Step(std::span<StateVector> x, std::span<const double> u) {
  Reserve(x.size());
  for (size_t i = 0; i < x.size(); ++i) Set(batch_, i, x[i], u[i]);
  // Advance also steps the padding of the last vector.
  Advance(batch_, steps_, 0, x.size(), plant_.control_period / steps_);
  for (size_t i = 0; i < x.size(); ++i) x[i] = Get(batch_, i);
}

void PendulumModel::Linearize(std::span<const StateVector> x, std::span<const double> u,
                              std::span<LinearModel> models) {
  Reserve(kPerturbed * x.size());
  const double velocity = kDifference * scale_.velocity();
  const std::array<double, 5> steps{kDifference, kDifference, velocity, velocity,
                                    kDifference * scale_.torque};
  for (size_t i = 0; i < x.size(); ++i) {
    for (size_t k = 0; k < kPerturbed; ++k) Set(batch_, kPerturbed * i + k, x[i], u[i]);
    ClosedFormBatch::Array* const varied[] = {&batch_.q1, &batch_.q2, &batch_.w1, &batch_.w2,
                                              &batch_.tau};
    for (size_t k = 0; k < kPerturbed; ++k) {
      const double step = steps[k / 2];
      (*varied[k / 2])[kPerturbed * i + k] += k % 2 == 0 ? step : -step;
    }
  }
  Advance(batch_, steps_, 0, kPerturbed * x.size(), plant_.control_period / steps_);
  for (size_t i = 0; i < x.size(); ++i) {
    const auto derivative = [&](size_t variable) -> StateVector {
      const size_t at = kPerturbed * i + 2 * variable;
      return (Get(batch_, at) - Get(batch_, at + 1)) / (2 * steps[variable]);
    };
    for (size_t k = 0; k < 4; ++k) models[i].A.col(static_cast<Eigen::Index>(k)) = derivative(k);
    models[i].B = derivative(4);
  }
}

}  // namespace upswing
