#pragma once

#include <functional>
#include <vector>

#include "base/progress.h"
#include "base/rng.h"
#include "base/thread_pool.h"
#include "extras/machine/simulated_machine.h"
#include "extras/machine/twin.h"
#include "extras/realaigym/hardware.h"
#include "extras/realaigym/rules.h"
#include "extras/realaigym/simulation.h"

/// Controllers on machines of a twin's posterior, by the rules of RealAIGym's hardware boards.
namespace upswing::realaigym {

/// Share of the estimated dry friction that the motors compensate, of both joints. The rules allow
/// it. Less than all keeps the sum from driving a joint whose friction is overestimated.
inline constexpr double kCompensated = 0.95;

/// A twin's machine with an Estimator, as an episode of a search: friction less its compensation,
/// and the motors' lag. The prediction removes the delay.
BoardEpisode EpisodeOf(const Twin& machine);
/// An episode of a machine drawn from the posterior, with the pushes of a trial. Leaves 0 to 1.5
/// times the zeros' deviations (one factor for both), and a delay of 0 or 2 ms.
BoardEpisode DrawEpisode(const Twin& twin, Robot robot, Rng& rng);

/// Makes the controller of a trial.
using TrialController = std::function<CycleController()>;

/// A controller of the boards as a machine's controller: an Estimator of the twin gives it the
/// state, and compensates friction. It acts at the steps of kBoardTimestep.
TrialController OnMachine(const BoardControllerMaker& make, const Twin& twin, Robot robot);

struct TrialRules {
  int count = 1000;
  bool pushes = true;  // two at each joint, of 0.2 to 0.5 N·m and 0.05 to 0.1 s, as in 2024
  // The pushes of a trial (N·m at a time in s) in place of random ones; empty: random.
  std::function<std::function<Joints(double)>(int trial)> push_of = {};
  uint64_t seed = 1;             // of the machines, pushes and periods
  double largest_velocity = 30;  // rad/s: the rules' safety limit, which ends a run
};

/// Runs of 10 s from hanging on machines drawn from the posterior. The report is that of real runs.
HardwareReport RunTrials(const Twin& twin, Robot robot, const TrialController& make,
                         const TrialRules& rules, ThreadPool* pool,
                         const Progress& progress = nullptr);

}  // namespace upswing::realaigym
