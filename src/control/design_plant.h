#pragma once

#include "pendulum/scale.h"

namespace upswing {

/// The plant that a controller is designed for, and how often the controller decides.
struct DesignPlant : Plant {
  double control_period = kControlPeriod;  // s

  DesignPlant() = default;
  DesignPlant(const Plant& plant, double period = kControlPeriod)  // NOLINT: a plant is one
      : Plant(plant), control_period(period) {}

  /// Number of physics steps in a control period. Throws BadInput if the plant is too stiff.
  int physics_steps() const;
};

}  // namespace upswing
