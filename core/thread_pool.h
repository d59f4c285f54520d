#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <thread>
#include <vector>

namespace upswing {

/// `wanted`, or if that is 0 the number of processors that this process may use.
int ResolveThreads(int64_t wanted);

/// Threads that wait for work. The caller is one of them, so a pool of one starts none.
class ThreadPool {
 public:
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  /// Calls task(0) … task(n-1), each on the thread that comes first, and returns when all are done.
  /// What a task computes must depend on its index alone: then the result has the same bits
  /// whatever the number of threads. Rethrows the exception of one task that raised one.
  void ParallelFor(int n, const std::function<void(int)>& task);

 private:
  void Stop();
  void Work(int thread);
  void RunTasks(int thread);

  const std::function<void(int)>* task_ = nullptr;
  int n_ = 0;
  std::atomic<int> next_{0};        // task that nobody has taken
  std::atomic<unsigned> round_{0};  // counts up at each hand-over
  std::atomic<int> running_{0};     // workers that have not finished this round
  std::atomic<bool> stopping_{false};
  std::vector<std::exception_ptr> errors_;  // (threads)
  std::vector<std::thread> workers_;        // (threads - 1)
};

}  // namespace upswing
