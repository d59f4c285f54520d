#pragma once

#include "control/lqr.h"
#include "control/pendulum_model.h"

/// Finds the states from which the linear-quadratic regulator catches the pendulum with its limited
/// motor. A swing-up has to reach one of them.
namespace upswing {

/// A level of the cost x' P x below which the regulator catches; 0 if none was found. The limited
/// torque holds each of 512 states spread over the ellipsoid of this level, and of each smaller
/// tested level. This is a simulation (Reist, Preiswerk, Tedrake, "Feedback-motion-planning with
/// simulation-based LQR-trees", 2016, section 3). It is no proof, because states in between are not
/// tested. Takes some hundredths of a second.
double RegionOfAttraction(const Lqr& lqr, const DesignPlant& plant);

class LqrCatch {
 public:
  /// Throws as SolveLqr does, and BadInput if no region of attraction is found.
  LqrCatch(const LqrConfig& config, const DesignPlant& plant);

  const Lqr& lqr() const { return lqr_; }

  /// The regulator's RegionOfAttraction.
  double region() const { return region_; }

  /// Number of control periods within which the regulator must reach the region.
  int steps() const { return steps_; }

  /// Whether the regulator brings the plant from this deviation from upright into the region, in a
  /// simulation. The limits are half of the settling time, at least 2.5 s, and a lean of 60° of
  /// either link.
  bool Holds(const StateVector& deviation) const;

 private:
  Lqr lqr_;
  double region_;
  int steps_;  // control periods within which it must reach the region
  DesignPlant plant_;
};

}  // namespace upswing
