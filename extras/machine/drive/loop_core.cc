#include "extras/machine/drive/loop_core.h"

#include <algorithm>
#include <utility>

#include "base/stopwatch.h"
#include "pendulum/task.h"

namespace upswing::machine {

LoopCore::LoopCore(const LoopConfig& config, Estimator& estimator, Supervisor& supervisor,
                   MachineController controller, LoopSummary& summary)
    : config_(config),
      estimator_(estimator),
      supervisor_(supervisor),
      controller_(std::move(controller)),
      summary_(summary),
      tick_(1 / static_cast<double>(config.hz)) {}

CycleFacts LoopCore::FactsOf(const CycleTimes& cycle, const std::optional<LinkReading>& reading) {
  CycleFacts facts{.time = cycle.now, .fresh = reading.has_value(), .period = cycle.period};
  if (reading) {
    last_reading_ = reading->time;
    facts.read_at = reading->time;
    facts.received = reading->received;
    facts.angle = reading->angle;
    facts.torque = reading->torque;
    facts.locked = reading->locked;
  } else if (last_reading_ >= 0) {
    ++summary_.unanswered;
  }
  facts.age = last_reading_ < 0 ? 0 : cycle.now - last_reading_;
  facts.zero = estimator_.zero();
  facts.state = estimator_.now();
  facts.ahead = estimator_.ahead();
  facts.energy = estimator_.energy();
  facts.expected = estimator_.expectation();
  const bool over =
      running_cycle_ > 0 &&
      static_cast<double>(cycle.number - running_cycle_) * tick_ >= config_.seconds - tick_ / 2;
  facts.stop = over || (config_.stop && config_.stop());
  return facts;
}

Joints LoopCore::ControllerTorque(const CycleTimes& cycle) {
  Joints torque = estimator_.CompensationTorque(config_.compensation);
  torque[config_.actuated_joint - 1] +=
      controller_(cycle.number - running_cycle_, estimator_.ahead());
  return torque;
}

Joints LoopCore::RunController(const CycleTimes& cycle, const CycleFacts& facts) {
  if (running_cycle_ == 0) running_cycle_ = cycle.number;
  summary_.driven = static_cast<double>(cycle.number - running_cycle_) * tick_;
  if (!Inverted(facts.state)) upright_since_ = -1;
  if (Inverted(facts.state) && upright_since_ < 0) upright_since_ = facts.time;
  summary_.upright = upright_since_ < 0 ? 0 : facts.time - upright_since_;
  const Stopwatch watch;
  const Joints wanted = ControllerTorque(cycle);
  summary_.longest_act = std::max(summary_.longest_act, watch.seconds());
  return wanted;
}

void LoopCore::CheckAge(double now, double usual) {
  if (enabled_ && !supervisor_.CheckAge(now - last_reading_ - usual)) {
    torque_ = {};
    enabled_ = false;
  }
}

void LoopCore::Decide(const CycleTimes& cycle, const std::optional<LinkReading>& reading) {
  estimator_.Update(cycle.now, reading ? &*reading : nullptr);
  const CycleFacts facts = FactsOf(cycle, reading);
  const LoopState state = supervisor_.Step(facts);
  Joints wanted{};
  if (state == LoopState::kRunning) wanted = RunController(cycle, facts);
  torque_ = supervisor_.Torque(wanted, facts);
  const LoopState after = supervisor_.state();
  enabled_ = state != LoopState::kIdle && after != LoopState::kFault;
  if (MayDrive(after)) ++summary_.moving;
}

}  // namespace upswing::machine
