#pragma once

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

  /// Number of threads on which the work runs between trials.
  int threads() const { return choices_[chosen_]; }

 private:
  void Begin();
  void End();
  /// Index in choices_ of the number that the current block of a trial takes.
  size_t candidate() const;

  ThreadPool* pool_;  // null if there is no choice
  std::function<double()> clock_;
  std::vector<int> choices_{1};  // 1, 2, 4, … threads
  size_t chosen_ = 0;            // index in choices_
  double until_trial_ = 0;       // seconds of work before the next trial; at most 0 in a trial
  int calls_ = 0;                // calls in this trial
  double trial_seconds_ = 0, block_seconds_ = 0;
  std::vector<double> fastest_;  // seconds of the fastest block of this trial on each of choices_
  double begin_ = 0;             // start of the current call, s
};

}  // namespace upswing
