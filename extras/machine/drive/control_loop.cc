#include "extras/machine/drive/control_loop.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/text.h"

namespace upswing::machine {
namespace {

constexpr double kAnswerShare = 0.5;  // share of a cycle that waits for the answer

}  // namespace

int64_t CyclesIn(double control_period, int64_t hz) {
  constexpr double kMostChange = 0.1;
  const double cycles = control_period * static_cast<double>(hz), whole = std::round(cycles);
  if (std::abs(whole - cycles) <= kMostChange * cycles) return static_cast<int64_t>(whole);
  throw BadInput(Concat("--hz: expected a rate with whole cycles in ", FormatNumber(control_period),
                        " s, the control period of the policy, got ", hz, ", which has ",
                        FormatNumber(cycles)));
}

MachineController PerCycle(MachineController controller, int64_t hz) {
  const int64_t cycles = CyclesIn(controller.period(), hz);
  auto per_cycle = [controller = std::move(controller), cycles, last = int64_t{-1}, torque = 0.0](
                       int64_t cycle, const PendulumState& state) mutable {
    // After missed cycles only the last of the missed actions is made up.
    const int64_t step = cycle / cycles;
    if (step != last) torque = controller(step, state);
    last = step;
    return torque;
  };
  return {std::move(per_cycle), 1 / static_cast<double>(hz)};
}

ControlLoop::ControlLoop(const LoopConfig& config, MachineLink& link, Estimator& estimator,
                         Supervisor& supervisor, MachineController controller, LogWriter& log)
    : config_(config),
      link_(link),
      estimator_(estimator),
      supervisor_(supervisor),
      controller_(PerCycle(std::move(controller), config.hz)),
      log_(log),
      period_(1 / static_cast<double>(config.hz)) {
  // The first deadline lies in the future.
  cycle_ = static_cast<int64_t>(link.Now() * static_cast<double>(config.hz)) + 1;
}

CycleFacts ControlLoop::FactsOf(double now, const std::optional<LinkReading>& reading) {
  CycleFacts facts{.time = now, .fresh = reading.has_value()};
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
  facts.age = last_reading_ < 0 ? 0 : now - last_reading_;
  facts.zero = estimator_.zero();
  facts.state = estimator_.now();
  facts.ahead = estimator_.ahead();
  facts.energy = estimator_.energy();
  facts.expected = estimator_.expectation();
  const bool over = running_cycle_ > 0 && static_cast<double>(cycle_ - running_cycle_) * period_ >=
                                              config_.seconds - period_ / 2;
  facts.stop = over || (config_.stop && config_.stop());
  return facts;
}

Joints ControlLoop::ControllerTorque() {
  Joints torque = estimator_.CompensationTorque(config_.compensation);
  torque[config_.actuated_joint - 1] += controller_(cycle_ - running_cycle_, estimator_.ahead());
  return torque;
}

ControlLoop::CycleStart ControlLoop::WaitForDeadline() {
  const double deadline = static_cast<double>(cycle_) * period_;
  link_.WaitUntil(deadline);
  const double now = link_.Now(), late = now - deadline;
  ++summary_.cycles;
  if (late <= LoopSummary::kOnTime) ++summary_.on_time;
  summary_.latest = std::max(summary_.latest, late);
  const auto missed = static_cast<int64_t>(std::max(0.0, late / period_));
  summary_.missed += missed;
  cycle_ += missed;
  return {.deadline = deadline, .now = now, .late = late};
}

void ControlLoop::DropOldTorque(double now) {
  if (enabled_ && !supervisor_.CheckAge(now - last_reading_ - period_)) {
    torque_ = {};
    enabled_ = false;
  }
}

std::optional<LinkReading> ControlLoop::Exchange(const CycleStart& start) {
  // A late cycle waits for its answer, too.
  const double until = std::max(start.deadline, start.now - period_ / 4) + kAnswerShare * period_;
  return link_.Exchange(torque_, enabled_, until);
}

Joints ControlLoop::RunController(const CycleFacts& facts) {
  if (running_cycle_ == 0) running_cycle_ = cycle_;
  summary_.driven = static_cast<double>(cycle_ - running_cycle_) * period_;
  if (!Inverted(facts.state)) upright_since_ = -1;
  if (Inverted(facts.state) && upright_since_ < 0) upright_since_ = facts.time;
  summary_.upright = upright_since_ < 0 ? 0 : facts.time - upright_since_;
  const Stopwatch watch;
  const Joints wanted = ControllerTorque();
  summary_.longest_act = std::max(summary_.longest_act, watch.seconds());
  return wanted;
}

void ControlLoop::LogReading(const LinkReading& reading, const PendulumState& state, double late) {
  const LoopRow row{.time = reading.time,
                    .angle = reading.angle,
                    .velocity = {state.w1, state.w2},
                    .torque = torque_,
                    .measured = reading.torque,
                    .state = static_cast<int>(supervisor_.state()),
                    .late = late};
  log_.Add(row, link_.simulated());
}

bool ControlLoop::Cycle() {
  const CycleStart start = WaitForDeadline();
  DropOldTorque(start.now);
  const std::optional<LinkReading> reading = Exchange(start);
  estimator_.Update(start.now, torque_, reading ? &*reading : nullptr);
  const CycleFacts facts = FactsOf(start.now, reading);
  const LoopState state = supervisor_.Step(facts);
  Joints wanted{};
  if (state == LoopState::kRunning) wanted = RunController(facts);
  torque_ = supervisor_.Torque(wanted, facts);
  const LoopState after = supervisor_.state();
  enabled_ = state != LoopState::kIdle && after != LoopState::kFault;
  if (MayDrive(after)) ++summary_.moving;
  if (reading) LogReading(*reading, facts.state, start.late);
  ++cycle_;
  return !supervisor_.ended();
}

void ControlLoop::SwitchOff() {
  for (int i = 0; i < kFarewells; ++i) {
    link_.Exchange({}, /*enabled=*/false, link_.Now() + kAnswerShare * period_);
    link_.WaitUntil(link_.Now() + kAnswerShare * period_);
  }
}

void ControlLoop::Run() {
  try {
    while (Cycle()) {
    }
  } catch (...) {
    SwitchOff();
    throw;
  }
  SwitchOff();
}

}  // namespace upswing::machine
