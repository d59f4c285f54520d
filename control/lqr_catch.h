#pragma once

#include "control/lqr.h"
#include "control/pendulum_model.h"

/// From where the linear-quadratic regulator catches the pendulum with the torque that its motor
/// has: what a swing-up has to reach.
namespace upswing {

/// A level of the cost x' P x within which all is caught: each of 512 states spread over the
/// ellipsoid of that level is held by the limited torque, and so are those of the smaller ones that
/// were tried; 0: none was found. By simulation, as Reist, Preiswerk, Tedrake,
/// "Feedback-motion-planning with simulation-based LQR-trees" (2016), section 3; no proof, as
/// states in between are not tried. Takes some hundredths of a second.
double RegionOfAttraction(const Lqr& lqr, const Plant& plant);

class LqrCatch {
 public:
  /// Throws as SolveLqr, and BadInput if no region of attraction is found.
  LqrCatch(const LqrConfig& config, const Plant& plant);

  const Lqr& lqr() const { return lqr_; }

  /// RegionOfAttraction of the regulator.
  double region() const { return region_; }

  /// Control periods within which it has to come there.
  int steps() const { return steps_; }

  /// Whether the regulator, from this deviation from upright on, brings the plant into the region
  /// within half of the time in which it settles, at least 2.5 s, without either link leaning
  /// further than 60°: by simulating just that. `model` is one of the plant.
  bool Holds(const StateVector& deviation, PendulumModel& model) const;

 private:
  Lqr lqr_;
  double region_;
  int steps_;     // control periods in which it has to come there
  double limit_;  // of the torque, N·m
};

}  // namespace upswing
