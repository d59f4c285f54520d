#pragma once

#include <array>
#include <functional>
#include <vector>

#include "base/thread_pool.h"

namespace upswing {

/// Chooses by timing the number of a pool's threads on which a repeated piece of work runs fastest.
/// Small pieces are often fastest on one thread. Results have the same bits for any number of
/// threads, so the choice may depend on the clock.
class ThreadTuner {
 public:
  /// The pool must outlive the tuner. A pool that is null, has one thread or does not adapt leaves
  /// no choice. `clock` returns seconds; the default is a steady clock.
  explicit ThreadTuner(ThreadPool* pool, std::function<double()> clock = {});

  /// Runs `work`, which calls ParallelFor of the pool. All calls should take about the same time,
  /// or the time should vary with a period of two or four calls.
  template <typename Work>
  void Run(const Work& work) {
    if (pool_ == nullptr) return work();
    Begin();
    work();
    End();
  }

  /// Number of threads on which the work runs now.
  int threads() const;

 private:
  void Begin();
  void End();
  /// Compares a timed block on the chosen number of threads with a timed block on the candidate
  /// number.
  void Compare();
  /// Moves to the next candidate, or ends the trial.
  void NextCandidate();

  ThreadPool* pool_;  // null if there is no choice
  std::function<double()> clock_;
  std::vector<int> choices_;  // 1, 2, 4, … threads
  size_t chosen_ = 0;         // index in choices_ of the number in use
  size_t candidate_ = 0;  // index in choices_ under trial; equal to chosen_ if no trial is running
  /// Whether the trial is testing more threads; it tests fewer threads afterwards.
  bool upwards_ = true;
  int calls_ = 0;                       // calls in the current block
  std::array<double, 2> seconds_ = {};  // (chosen, candidate) time in this round
  std::vector<double> ratios_;          // candidate time over chosen time, one per round
  double trial_seconds_ = 0;            // time that this trial has taken, s
  double until_trial_ = 0;              // seconds of work before the next trial
  double begin_ = 0;                    // start of the current call, s
};

}  // namespace upswing
