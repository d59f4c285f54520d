#pragma once

#include <memory>
#include <string>

#include "control/lqr_catch.h"

namespace upswing {

/// Swings up by one means, and holds upright with the linear-quadratic regulator wherever that
/// catches (LqrCatch::Holds, asked anew at each decision).
class HybridPolicy : public ComputedPolicy {
 public:
  /// `swing_up`: any policy of the double pendulum with one torque. `kind`, `settings`: what it is
  /// called and how it was made. Throws as SolveLqr, and BadInput if it is none.
  HybridPolicy(const std::string& kind, const Options& settings, const LqrConfig& lqr,
               std::shared_ptr<const Policy> swing_up, const Plant& plant);

  std::string description() const override;
  std::unique_ptr<Memory> Start(int num_envs) const override;
  void Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const override;
  int obs_size() const override { return swing_up_->obs_size(); }

 private:
  struct Parts;

  std::shared_ptr<const Policy> swing_up_;
  LqrCatch upright_;
};

}  // namespace upswing
