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
  int threads() const { return current().choices[current().chosen]; }

 private:
  /// The best number of threads, and the trial that finds it.
  struct Choice {
    std::vector<int> choices{1};  // 1, 2, 4, … threads
    size_t chosen = 0;            // index in choices
    double until_trial = 0;       // seconds of work before the next trial; at most 0 in a trial
    int calls = 0;                // calls in this trial
    double trial_seconds = 0, block_seconds = 0;
    std::vector<double> fastest;  // seconds of the fastest block of this trial on each of choices

    /// Index in choices of the number that the current block of a trial takes.
    size_t candidate() const;
  };

  void Begin();
  void End();
  const Choice& current() const { return pool_ != nullptr && pool_->lent() > 0 ? lent_ : all_; }
  Choice& current() { return pool_ != nullptr && pool_->lent() > 0 ? lent_ : all_; }

  ThreadPool* pool_;  // null if there is no choice
  std::function<double()> clock_;
  Choice all_, lent_;  // with all threads of the pool, and while it has lent some
  double begin_ = 0;   // start of the current call, s
};

}  // namespace upswing
