#pragma once

#include <functional>
#include <mutex>
#include <vector>

#include "base/progress.h"
#include "base/thread_pool.h"
#include "extras/machine/twin/simulated_machine.h"
#include "extras/realaigym/rules.h"
#include "extras/realaigym/uptime.h"

namespace upswing::realaigym {

/// Makes the controller of a simulation or trial.
using ControllerMaker = std::function<CycleController()>;

/// Simulates an episode on the benchmark's plant in steps of kBoardTimestep, from hanging at rest.
/// The controller gets the time (s) and the measured state at each step. The log has the true
/// states, and the torques that act after the motors' response and limits, without pushes.
MachineLog SimulateEpisode(Robot robot, const BoardEpisode& episode,
                           const CycleController& controller, double seconds = kBoardSeconds);

/// The state after an episode's 10 s.
PendulumState EndOf(Robot robot, const BoardEpisode& episode, const CycleController& controller);

/// The results of `run` for 0 to `count` - 1, computed on the pool's threads. Counts the calls.
template <typename Run>
auto RunAll(int count, ThreadPool* pool, const Progress& progress, const Run& run) {
  std::vector<decltype(run(0))> results(count);
  std::mutex mutex;
  double done = 0;
  ParallelFor(pool, count, [&](int i) {
    results[i] = run(i);
    if (!progress) return;
    const std::lock_guard lock(mutex);
    progress(++done, count);
  });
  return results;
}

/// A controller that resets interrupt. After each reset, a controller that `make` makes begins. A
/// reset controls both motors without friction compensation.
CycleController WithResets(const ControllerMaker& make, const ResetRules& rules, uint64_t seed);

}  // namespace upswing::realaigym
