#pragma once

#include <cstdint>

#include "pendulum/task.h"

namespace upswing::machine {

/// A controller of one machine: from the state to the torque of its motor.
class MachineController {
 public:
  virtual ~MachineController() = default;
  /// Steps per second. A torque is held for a step.
  virtual int64_t hz() const = 0;
  /// The motor's torque (N·m) in a step; number 0 is the first one. Steps can be left out.
  virtual double Torque(int64_t step, const PendulumState& state) = 0;
};

}  // namespace upswing::machine
