#pragma once

#include <concepts>
#include <cstdint>
#include <functional>
#include <utility>

#include "pendulum/plant.h"
#include "pendulum/task.h"

/// Controllers of one machine, at the rate of its loop.
namespace upswing::machine {

/// A controller of one machine: the motor's torque (N·m) in a step of its period (s), from the
/// state. Steps count from 0, and can be left out.
class MachineController {
 public:
  using Law = std::function<double(int64_t step, const PendulumState& state)>;

  template <std::convertible_to<Law> F>
  MachineController(F law, double period = kControlPeriod)  // NOLINT: a law is a controller
      : law_(std::move(law)), period_(period) {}

  double operator()(int64_t step, const PendulumState& state) const { return law_(step, state); }
  double period() const { return period_; }

 private:
  Law law_;
  double period_;  // s
};

/// Cycles of a loop with `hz` cycles per second in a control period (s), not rounded. Throws
/// BadInput if the period is shorter than a cycle.
double CyclesIn(double control_period, int64_t hz);

/// The controller at the rate of a loop: its steps are cycles, `hz` per second. It acts in the
/// cycle nearest to the end of each control period of the given one, and holds its torque between.
/// Throws as CyclesIn does.
MachineController PerCycle(MachineController controller, int64_t hz);

}  // namespace upswing::machine
