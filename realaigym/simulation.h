#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/progress.h"
#include "core/thread_pool.h"
#include "realaigym/rules.h"

namespace upswing {

/// What a controller is told of a block of simulations: the state with noise and delay.
struct BoardMeasurement {
  Lanes q1, q2, w1, w2;  // rad, rad/s
};

/// Controls a block of simulations, each from its beginning on. It is called at every step of
/// kBoardTimestep, and may hold a torque for longer.
class BoardController {
 public:
  virtual ~BoardController() = default;
  /// Torques of the motor (N·m) for the first `count` simulations at step 0, 1, …
  virtual void Act(int step, const BoardMeasurement& measured, size_t count, Lanes& torque) = 0;
};

/// Makes the controller of the block of simulations that begins with number `first`.
using BoardControllerMaker = std::function<std::unique_ptr<BoardController>(size_t first)>;

/// One step of one simulation, for tables: the state, and the torque that then acts.
struct BoardSample {
  double time;
  BoardState state;
  double torque;  // N·m
};

/// Simulates all episodes, in blocks on the pool's threads. With `trace`, it gets the steps of the
/// first one. `progress` counts them.
std::vector<BoardOutcome> SimulateOnBoard(Robot robot, std::span<const BoardEpisode> episodes,
                                          const BoardControllerMaker& make, ThreadPool* pool,
                                          std::vector<BoardSample>* trace = nullptr,
                                          const Progress& progress = nullptr);

}  // namespace upswing
