#include "control/pendulum_model.h"

#include <array>

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

}  // namespace

int DesignPlant::physics_steps() const {
  return PhysicsStepsFor(*this, control_period, "design plant");
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
