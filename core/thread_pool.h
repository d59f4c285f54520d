#pragma once

#include <functional>
#include <memory>

namespace upswing {

/// Threads that wait for work. The caller counts as one, so a pool of one starts no thread.
class ThreadPool {
 public:
  /// A pool that `adapts` lets a ThreadTuner choose how many of its threads a piece of work takes.
  explicit ThreadPool(int threads, bool adapts = false);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const { return threads_; }
  bool adapts() const { return adapts_; }
  /// Threads that take tasks now; see Use.
  int used() const { return used_; }

  /// Lets the first `threads` threads, the caller's included, take tasks from now on; the others
  /// sleep. 1 to threads(). Not from within a task.
  void Use(int threads);

  /// Calls task(0) … task(n-1), each on the next free thread, and returns when all are done,
  /// without waiting for threads that woke too late to take one. What a task computes must depend
  /// on its index alone: then the result has the same bits for any number of threads. If tasks
  /// throw, one of the exceptions is rethrown, and the other tasks may or may not have run. Must
  /// not be called from two threads at once, nor from within a task.
  void ParallelFor(int n, const std::function<void(int)>& task);

 private:
  struct Workers;  // in thread_pool.cc: where there are no threads, as in a browser, no header asks

  int threads_;
  bool adapts_;
  int used_;
  std::unique_ptr<Workers> workers_;  // none in a pool of one
};

/// ParallelFor on an optional pool: without one the caller runs all tasks.
void ParallelFor(ThreadPool* pool, int n, const std::function<void(int)>& task);

}  // namespace upswing
