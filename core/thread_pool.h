#pragma once

#include <functional>
#include <memory>

namespace upswing {

/// Threads that wait for work. The caller counts as one, so a pool of one starts no thread.
class ThreadPool {
 public:
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const { return threads_; }

  /// Calls task(0) … task(n-1), each on the next free thread, and returns when all are done,
  /// without waiting for threads that woke too late to take one. What a task computes must depend
  /// on its index alone: then the result has the same bits for any number of threads. If tasks
  /// throw, one of the exceptions is rethrown, and the other tasks may or may not have run. Must
  /// not be called from two threads at once, nor from within a task.
  void ParallelFor(int n, const std::function<void(int)>& task);

 private:
  struct Workers;  // in thread_pool.cc: where there are no threads, as in a browser, no header asks

  int threads_;
  std::unique_ptr<Workers> workers_;  // none in a pool of one
};

/// ParallelFor on an optional pool: without one the caller runs all tasks.
void ParallelFor(ThreadPool* pool, int n, const std::function<void(int)>& task);

}  // namespace upswing
