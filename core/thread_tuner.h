#pragma once

#include <array>
#include <functional>
#include <vector>

#include "core/thread_pool.h"

namespace upswing {

/// Finds by timing on how many of a pool's threads a repeated piece of work runs fastest, and runs
/// it there. Small pieces are often fastest on one thread. Results have the same bits for any
/// number of threads, so the choice may follow the clock.
class ThreadTuner {
 public:
  /// The pool must outlive the tuner. A null pool, a pool of one thread or a pool of a fixed number
  /// of threads leaves nothing to choose. `clock` returns seconds; by default a steady clock does.
  explicit ThreadTuner(ThreadPool* pool, std::function<double()> clock = {});

  /// Runs `work`, which calls ParallelFor of the pool. Calls should take about the same time, or
  /// vary with a period of two or four calls.
  template <typename Work>
  void Run(const Work& work) {
    if (pool_ == nullptr) return work();
    Begin();
    work();
    End();
  }

  /// Threads that the work runs on now.
  int threads() const;

 private:
  void Begin();
  void End();
  /// A block on the chosen number of threads and one on the candidate have been timed.
  void Compare();
  /// Moves to the next candidate, or ends the trial.
  void NextCandidate();

  ThreadPool* pool_;  // null: nothing to choose
  std::function<double()> clock_;
  std::vector<int> choices_;            // 1, 2, 4, … threads
  size_t chosen_ = 0;                   // index in choices_
  size_t candidate_ = 0;                // equal to chosen_: no trial is running
  bool upwards_ = true;                 // whether the trial tries more threads; then it tries fewer
  int calls_ = 0;                       // of the present block
  std::array<double, 2> seconds_ = {};  // of this round, on the chosen and the candidate number
  std::vector<double> ratios_;          // candidate over chosen, of each round
  double trial_seconds_ = 0;            // that this trial has taken
  double until_trial_ = 0;              // seconds of work before the next trial
  double begin_ = 0;                    // s, of this call
};

}  // namespace upswing
