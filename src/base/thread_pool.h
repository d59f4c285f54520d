#pragma once

#include <functional>
#include <memory>

namespace upswing {

/// Whether programs of this kind can have threads. A page's core has one.
#if defined(__wasm__)
inline constexpr bool kHasThreads = false;
#else
inline constexpr bool kHasThreads = true;
#endif

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
  /// Number of threads that sleep while other work has their processors; see Lend.
  int lent() const { return lent_; }

  /// Lets only the first `threads` threads (1 to threads(), including the caller) take tasks from
  /// now on, and at most threads() - lent() of them, at least one. The other threads sleep. Do not
  /// call it within a task.
  void Use(int threads);

  /// Leaves the processors of `threads` threads to work outside of the pool, until Lend(0). Do not
  /// call it within a task.
  void Lend(int threads);

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
  int requested_;  // threads of the last Use
  int used_;
  int lent_ = 0;
  std::unique_ptr<Workers> workers_;  // null in a pool of one thread
};

/// A task on its own thread, while the caller goes on. In a browser the constructor runs the task.
class BackgroundTask {
 public:
  /// Throws std::system_error if the system has no thread to spare.
  explicit BackgroundTask(const std::function<void()>& task);
  /// Waits for the task.
  ~BackgroundTask();
  BackgroundTask(const BackgroundTask&) = delete;
  BackgroundTask& operator=(const BackgroundTask&) = delete;

  bool done() const;
  /// Waits for the task. Rethrows its exception. Call it once.
  void Wait();

 private:
  /// Defined in thread_pool.cc, as Workers is.
  struct Future;
  std::unique_ptr<Future> future_;
};

/// Runs ParallelFor on the pool; if it is null, the caller runs all tasks.
void ParallelFor(ThreadPool* pool, int n, const std::function<void(int)>& task);

}  // namespace upswing
