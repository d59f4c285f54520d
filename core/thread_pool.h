#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace upswing {

/// Number of processors that this process may use, by its affinity and its container's limit; at
/// least 1.
int UsableProcessors();

/// `wanted`, or if that is 0 as many as UsableProcessors, but no more than 8.
int ResolveThreads(int64_t wanted);

/// Threads that wait for work. The caller is one of them, so a pool of one starts none.
class ThreadPool {
 public:
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  /// Calls task(0) … task(n-1), each on the thread that comes first, and returns when all are done;
  /// it does not wait for a thread that comes too late to do any. What a task computes must depend
  /// on its index alone: then the result has the same bits whatever the number of threads. If tasks
  /// raise exceptions, one of them is rethrown, and the other tasks may have run or not. Not for
  /// two callers at once, nor from within a task.
  void ParallelFor(int n, const std::function<void(int)>& task);

 private:
  void Stop();
  void Work();
  void RunTasks();

  const std::function<void(int)>* task_ = nullptr;
  std::atomic<uint64_t> ticket_{0};  // the next task to take; see thread_pool.cc
  std::atomic<uint32_t> round_{0};   // counts up at each ParallelFor: what idle threads wait for
  std::atomic<uint32_t> unfinished_{0};  // tasks of this round
  std::atomic<bool> stopping_{false};
  std::mutex error_mutex_;
  std::exception_ptr error_;
  std::vector<std::thread> workers_;  // (threads - 1)
};

/// The same on a pool that need not be there: without one the caller does all.
void ParallelFor(ThreadPool* pool, int n, const std::function<void(int)>& task);

}  // namespace upswing
