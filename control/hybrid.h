#pragma once

#include <functional>
#include <memory>
#include <string>

#include "control/lqr_catch.h"
#include "control/swing_up.h"

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

/// Swing-up by a law: a torque for each deviation from upright.
class LawPolicy : public PendulumController {
 public:
  using Law = std::function<double(const StateVector& deviation)>;

  LawPolicy(const std::string& kind, const std::string& description, const Options& settings,
            const Plant& plant, Law law)
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
