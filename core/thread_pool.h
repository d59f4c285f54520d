#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace upswing {

/// Threads that wait for work. The caller counts as one, so a pool of one starts no thread.
class ThreadPool {
 public:
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  /// Calls task(0) … task(n-1), each on the next free thread, and returns when all are done,
  /// without waiting for threads that woke too late to take one. What a task computes must depend
  /// on its index alone: then the result has the same bits for any number of threads. If tasks
  /// throw, one of the exceptions is rethrown, and the other tasks may or may not have run. Must
  /// not be called from two threads at once, nor from within a task.
  void ParallelFor(int n, const std::function<void(int)>& task);

 private:
  void Stop();
  void Work();
  void RunTasks();

  const std::function<void(int)>* task_ = nullptr;
  std::atomic<uint64_t> ticket_{0};      // the next task to take; see thread_pool.cc
  std::atomic<uint32_t> round_{0};       // increases at each ParallelFor; idle threads wait for it
  std::atomic<uint32_t> unfinished_{0};  // tasks of this round
  std::atomic<bool> stopping_{false};
  std::mutex error_mutex_;
  std::exception_ptr error_;
  std::vector<std::thread> workers_;  // (threads - 1)
};

/// ParallelFor on an optional pool: without one the caller runs all tasks.
void ParallelFor(ThreadPool* pool, int n, const std::function<void(int)>& task);

}  // namespace upswing
