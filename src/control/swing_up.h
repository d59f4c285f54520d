#pragma once

#include <functional>
#include <string>
#include <utility>

#include "control/controller.h"
#include "control/settings.h"
#include "pendulum/equations.h"

/// Swing-up laws, each a formula. They ignore the motor's limit; control/hybrid.h catches the
/// pendulum with LQR once they have brought it near upright.
namespace upswing {

/// Drives the energy E to that of rest upright and link 1 to upright, so that link 2 swings through
/// upright again and again. Fantoni, Lozano, Spong, "Energy based control of the Pendubot", IEEE
/// Transactions on Automatic Control 45 (2000). For V = kE E²/2 + kD w1²/2 + kP q̃1²/2, without
/// damping, the torque makes dV/dt = -w1². The torque's denominator avoids 0 only if kD is large
/// against kE. The standard gains, for a weak motor, pass through 0 on the way up; there the torque
/// is at its limit and changes sign.
double EnergyShapingTorque(const EnergyShapingConfig& config, const Manipulator& plant,
                           const StateVector& deviation);

/// Makes q̈1 = -kP q̃1 - kD w1 - kE E w1 by collocated partial feedback linearisation: Spong,
/// "Partial feedback linearization of underactuated mechanical systems" (IROS 1994). The last term
/// is our addition and pumps energy.
double PartialFeedbackTorque(const PartialFeedbackConfig& config, const Manipulator& plant,
                             const StateVector& deviation);

/// Swing-up by a law that gives a torque for each deviation from upright.
class LawPolicy : public PendulumController {
 public:
  using Law = std::function<double(const StateVector& deviation)>;

  LawPolicy(const std::string& kind, const std::string& description, const Options& settings,
            const DesignPlant& plant, Law law)
      : PendulumController(kind, settings, plant),
        description_(description),
        law_(std::move(law)) {}

  std::string description() const override { return description_; }

 private:
  double Torque(const StateVector& deviation, size_t /*env*/, Memory& /*memory*/) const override {
    return law_(deviation);
  }

  std::string description_;
  Law law_;
};

}  // namespace upswing
