#include "control/hybrid.h"

#include "base/error.h"
#include "base/text.h"

namespace upswing {

/// The swing-up's memory, and a plant to look ahead with.
struct HybridPolicy::Parts : Memory {
  Parts(std::unique_ptr<Memory> memory, const Plant& plant)
      : swing_up(std::move(memory)), model(plant) {}

  std::unique_ptr<Memory> swing_up;
  PendulumModel model;
};

HybridPolicy::HybridPolicy(const std::string& kind, const Options& settings, const LqrConfig& lqr,
                           std::shared_ptr<const Policy> swing_up, const Plant& plant)
    : ComputedPolicy(kind, settings, plant), swing_up_(std::move(swing_up)), upright_(lqr, plant) {
  if (swing_up_->info().observation) SetObservation(*swing_up_->info().observation);
  const std::string& task = swing_up_->info().task;
  if ((task.empty() || task == kDoublePendulum) && swing_up_->action_size() == 1) return;
  throw BadInput(
      Concat(kind, ": expected a swing-up of the task ", kDoublePendulum, ", got one of ", task));
}

std::string HybridPolicy::description() const {
  return Concat(swing_up_->description(), ", and lqr upright, region of attraction x'Px < ",
                Rounded(upright_.region()));
}

std::unique_ptr<Policy::Memory> HybridPolicy::Start(int num_envs) const {
  return std::make_unique<Parts>(swing_up_->Start(num_envs), plant());
}

void HybridPolicy::Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const {
  auto& parts = static_cast<Parts&>(memory);
  swing_up_->Act(obs, action, *parts.swing_up);
  for (int i = 0; i < obs.rows(); ++i) {
    const StateVector deviation = UprightDeviation(obs.row(i));
    if (upright_.Holds(deviation, parts.model)) {
      action(i, 0) = Limited(upright_.lqr().Torque(deviation));
    }
  }
}

}  // namespace upswing
