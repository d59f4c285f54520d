#pragma once

#include "control/pendulum_model.h"
#include "sim/double_pendulum.h"

/// The equations of motion as control laws use them: M(q) q̈ + h(q, q̇) = [u, 0]'.
namespace upswing {

/// The mass matrix, what acts besides the motor, and the energy, in one state.
struct ManipulatorTerms {
  double M11, M12, M22;  // kg·m²
  double h1, h2;         // N·m: velocity, gravity and damping
  double energy;         // kinetic and potential, J; that of rest upright is 0
};

/// Symbols and constants as in sim/closed_form.h.
class Manipulator {
 public:
  explicit Manipulator(const Plant& plant);

  ManipulatorTerms At(const StateVector& x) const;

 private:
  double J1_, J2_, b_, G1_, G2_, d1_, d2_;
};

}  // namespace upswing
