#pragma once

#include <memory>
#include <optional>

#include "control/lqr.h"
#include "control/trajectory.h"

namespace upswing {

/// Settings of the predictive controller. The cost is that of the regulator, over the horizon, and
/// its x' P x at the end.
struct MpcConfig {
  double seconds = 2.5;    // horizon
  int64_t iterations = 2;  // of trajectory optimisation at each decision

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);
};

/// Model predictive control by trajectory optimisation: each decision improves the plan of the one
/// before, from where the pendulum is now, and takes its first torque. Tassa, Erez, Todorov,
/// "Synthesis and stabilization of complex behaviors through online trajectory optimization"
/// (IROS 2012).
class MpcPolicy : public PendulumController {
 public:
  /// Throws as SolveLqr.
  MpcPolicy(LqrConfig lqr, MpcConfig config, const Plant& plant);

  std::string description() const override;
  std::unique_ptr<Memory> Start(int num_envs) const override;

 private:
  struct Plans;

  double Torque(const StateVector& deviation, size_t env, Memory& memory) const override;

  MpcConfig config_;
  Lqr lqr_;
  QuadraticCost cost_;
};

}  // namespace upswing
