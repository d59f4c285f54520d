#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/thread_pool.h"
#include "realaigym/rules.h"

namespace upswing {

/// What a controller is told of a block of simulations: the state with noise and delay.
struct GymMeasurement {
  Lanes q1, q2, w1, w2;  // rad, rad/s
};

/// Controls a block of simulations, each from its beginning on. It is called at every step of
/// kGymTimestep, and may hold a torque for longer.
class GymController {
 public:
  virtual ~GymController() = default;
  /// Torques of the motor (N·m) for the first `count` simulations at step 0, 1, …
  virtual void Act(int step, const GymMeasurement& measured, size_t count, Lanes& torque) = 0;
};

/// Makes the controller of the block of simulations that begins with number `first`.
using GymControllerMaker = std::function<std::unique_ptr<GymController>(size_t first)>;

/// One step of one simulation, for tables: the state, and the torque that then acts.
struct GymSample {
  double time;
  GymState state;
  double torque;  // N·m
};

/// Simulates all episodes, in blocks on the pool's threads. With `trace`, it gets the steps of the
/// first one. `done`, if any, is told how many are finished, from any thread.
std::vector<GymOutcome> SimulateGym(GymRobot robot, std::span<const GymEpisode> episodes,
                                    const GymControllerMaker& make, ThreadPool* pool,
                                    std::vector<GymSample>* trace = nullptr,
                                    const std::function<void(size_t)>& done = nullptr);

}  // namespace upswing
