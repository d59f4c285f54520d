#include "extras/machine/drive/control_loop.h"

#include <algorithm>
#include <utility>

namespace upswing::machine {
namespace {

constexpr double kAnswerShare = 0.5;  // share of a cycle that waits for the answer

}  // namespace

ControlLoop::ControlLoop(const LoopConfig& config, MachineLink& link, Estimator& estimator,
                         Supervisor& supervisor, MachineController controller, LogWriter& log)
    : link_(link),
      estimator_(estimator),
      supervisor_(supervisor),
      log_(log),
      core_(config, estimator, supervisor, PerCycle(std::move(controller), config.hz), summary_),
      period_(1 / static_cast<double>(config.hz)) {
  // The first deadline lies in the future.
  cycle_ = static_cast<int64_t>(link.Now() * static_cast<double>(config.hz)) + 1;
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
  if (MayDrive(supervisor_.state())) summary_.moving += missed;
  cycle_ += missed;
  return {.deadline = deadline, .now = now, .late = late};
}

std::optional<LinkReading> ControlLoop::Exchange(const CycleStart& start) {
  // A late cycle waits for its answer, too.
  const double until = std::max(start.deadline, start.now - period_ / 4) + kAnswerShare * period_;
  return link_.Exchange(core_.torque(), core_.enabled(), until);
}

void ControlLoop::LogReading(const LinkReading& reading, double late) {
  const LoopRow row{.time = reading.time,
                    .angle = reading.angle,
                    .velocity = {estimator_.now().w1, estimator_.now().w2},
                    .torque = core_.torque(),
                    .measured = reading.torque,
                    .state = static_cast<int>(supervisor_.state()),
                    .late = late};
  log_.Add(row, link_.simulated());
}

bool ControlLoop::Cycle() {
  const CycleStart start = WaitForDeadline();
  // After a pause of this process, the torques of the cycle before are too old to be sent.
  core_.CheckAge(start.now, period_);
  const std::optional<LinkReading> reading = Exchange(start);
  estimator_.Send(start.now, core_.torque());
  core_.Decide({.number = cycle_, .now = start.now, .period = period_}, reading);
  if (reading) LogReading(*reading, start.late);
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
