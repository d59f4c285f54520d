#include "control/hybrid.h"

#include "base/error.h"
#include "base/text.h"

namespace upswing {

HybridPolicy::HybridPolicy(const std::string& kind, const Options& settings, const LqrConfig& lqr,
                           std::shared_ptr<const Policy> swing_up, const DesignPlant& plant)
    : ComputedPolicy(kind, settings, plant), swing_up_(std::move(swing_up)), upright_(lqr, plant) {
  if (swing_up_->info().observation) {
    SetObservation(*swing_up_->info().observation, ScaleIn(swing_up_->info()));
  }
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
  return swing_up_->Start(num_envs);
}

void HybridPolicy::Act(Matrix<const float> obs, Matrix<double> action, Memory& memory) const {
  swing_up_->Act(obs, action, memory);
  for (int i = 0; i < obs.rows(); ++i) {
    const StateVector deviation = UprightDeviation(obs.row(i), scale());
    if (upright_.Holds(deviation)) action(i, 0) = Limited(upright_.lqr().Torque(deviation));
  }
}

}  // namespace upswing
