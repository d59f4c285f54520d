#pragma once

#include <memory>
#include <string>

#include "control/lqr_catch.h"

namespace upswing {

/// Swings up with another policy, and holds upright with the linear-quadratic regulator whenever
/// that catches. Each decision asks LqrCatch::Holds again.
class HybridPolicy : public ComputedPolicy {
 public:
  /// `swing_up`: any policy of the double pendulum with one torque. `kind`, `settings`: its name
  /// and how it was made. Throws as SolveLqr does, and BadInput if `swing_up` is not such a policy.
  HybridPolicy(const std::string& kind, const Options& settings, const LqrConfig& lqr,
               std::shared_ptr<const Policy> swing_up, const DesignPlant& plant);

  std::string description() const override;
  std::unique_ptr<Memory> Start(int num_envs) const override;
  void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const override;
  int obs_size() const override { return swing_up_->obs_size(); }

 private:
  std::shared_ptr<const Policy> swing_up_;
  LqrCatch upright_;
};

}  // namespace upswing
