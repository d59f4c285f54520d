#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "extras/machine/twin/twin.h"
#include "extras/realaigym/hardware.h"
#include "extras/realaigym/simulation.h"
#include "extras/realaigym/uptime.h"

/// Controllers on machines of a twin's posterior, by the rules of RealAIGym's hardware boards.
namespace upswing::realaigym {

/// Share of the estimated dry friction that the motors compensate, of both joints. The rules allow
/// it. Less than all keeps the sum from driving a joint whose friction is overestimated.
inline constexpr double kCompensated = 0.95;

/// Makes the controller of a trial. The seed is for its resets.
using TrialController = std::function<CycleController(uint64_t seed)>;

/// A controller of the boards on a machine: an Estimator of the twin gives it the state, and
/// compensates friction. With `resets`, these interrupt it.
TrialController OnMachine(const ControllerMaker& make, const Twin& twin, Robot robot,
                          const std::optional<ResetRules>& resets = {});

struct TrialRules {
  int count = 1000;
  bool pushes = true;  // two at each joint, of 0.2 to 0.5 N·m and 0.05 to 0.1 s, as in 2024
  // The pushes of a trial (N·m at a time in s) in place of random ones; empty: random.
  std::function<std::function<Joints(double)>(int trial)> push_of = {};
  uint64_t seed = 1;             // of the machines, pushes, resets and periods
  double largest_velocity = 30;  // rad/s: the rules' safety limit, which ends a run
};

/// Runs of 10 s from hanging on machines drawn from the posterior. The report is that of real runs.
HardwareReport RunTrials(const Twin& twin, Robot robot, const TrialController& make,
                         const TrialRules& rules, ThreadPool* pool,
                         const Progress& progress = nullptr);

/// Runs of 60 s by score version 3 on machines drawn from the posterior. The rules' pushes and
/// velocity limit have no effect.
std::vector<UptimeRun> RunUptimeTrials(const Twin& twin, const TrialController& make,
                                       const TrialRules& rules, ThreadPool* pool,
                                       const Progress& progress = nullptr);

}  // namespace upswing::realaigym
