#pragma once

#include <functional>
#include <memory>

namespace upswing {

/// Threads that wait for work. The caller counts as one thread, so a pool of one thread starts
/// none.
class ThreadPool {
 public:
  /// Makes a pool of `threads` threads. If it `adapts`, a ThreadTuner chooses how many of them a
  /// piece of work takes.
  explicit ThreadPool(int threads, bool adapts = false);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const { return threads_; }
  bool adapts() const { return adapts_; }
  /// Number of threads that take tasks now; see Use.
  int used() const { return used_; }

  /// Lets only the first `threads` threads (1 to threads(), including the caller) take tasks from
  /// now on. The other threads sleep. Do not call it within a task.
  void Use(int threads);

  /// Calls task(0) … task(n-1), each on the next free thread, and returns when all tasks are done.
  /// It does not wait for threads that wake too late to take a task.
  ///
  /// The result of a task must depend only on its index. Then it has the same bits for any number
  /// of threads. If tasks throw, this rethrows one of the exceptions, and the other tasks may or
  /// may not have run. Do not call it from two threads at once or within a task.
  void ParallelFor(int n, const std::function<void(int)>& task);

 private:
  /// Defined in thread_pool.cc: this header needs no threads, which a browser may lack.
  struct Workers;

  int threads_;
  bool adapts_;
  int used_;
  std::unique_ptr<Workers> workers_;  // null in a pool of one thread
};

/// Runs ParallelFor on the pool; if it is null, the caller runs all tasks.
void ParallelFor(ThreadPool* pool, int n, const std::function<void(int)>& task);

}  // namespace upswing
