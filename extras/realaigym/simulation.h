#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/thread_pool.h"
#include "extras/machine/log.h"
#include "extras/realaigym/rules.h"

namespace upswing::realaigym {

/// Measurements of a block of simulations: the states with noise and delay, or estimates.
struct BoardMeasurement {
  Lanes q1, q2, w1, w2;    // rad, rad/s
  bool estimated = false;  // whether w1 and w2 come from a model

  /// Sets the first simulation's measurement to an estimated state.
  void SetFirst(const PendulumState& state, bool from_model) {
    q1[0] = state.q1;
    q2[0] = state.q2;
    w1[0] = state.w1;
    w2[0] = state.w2;
    estimated = from_model;
  }
};

/// Controls a block of simulations from their beginnings. Act is called at every step of
/// kBoardTimestep, and the controller may hold a torque for longer.
class BoardController {
 public:
  virtual ~BoardController() = default;
  /// Sets the motor torques (N·m) of the first `count` simulations at step 0, 1, …
  virtual void Act(int step, const BoardMeasurement& measured, size_t count, Lanes& torque) = 0;
};

/// Makes the controller of the block whose first simulation has number `first`.
using BoardControllerMaker = std::function<std::unique_ptr<BoardController>(size_t first)>;

/// One step of a simulation, for tables: the state, and the torques that act after it.
struct BoardSample {
  double time;
  BoardState state;
  Joints torque;  // N·m
};

/// Simulates all episodes, in blocks on the pool's threads. `trace`, if given, gets the steps of
/// the first episode. `progress` counts episodes.
std::vector<BoardOutcome> SimulateOnBoard(Robot robot, std::span<const BoardEpisode> episodes,
                                          const BoardControllerMaker& make, ThreadPool* pool,
                                          std::vector<BoardSample>* trace = nullptr,
                                          const Progress& progress = nullptr);

}  // namespace upswing::realaigym
