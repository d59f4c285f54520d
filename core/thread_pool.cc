#include "core/thread_pool.h"

#include <sched.h>

#include <algorithm>
#include <utility>

namespace upswing {
namespace {

/// Waits until `value` differs from `old`: first spinning (work of well under a millisecond comes
/// back to back), then asleep, so that an idle pool costs nothing.
template <typename T>
void WaitWhile(const std::atomic<T>& value, T old) {
  for (int spin = 0; spin < 2000; ++spin) {
    if (value.load(std::memory_order_acquire) != old) return;
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
  }
  value.wait(old, std::memory_order_acquire);
}

}  // namespace

int ResolveThreads(int64_t wanted) {
  if (wanted > 0) return static_cast<int>(wanted);
  cpu_set_t usable;
  const bool known = sched_getaffinity(0, sizeof(usable), &usable) == 0;
  return known ? std::max(1, CPU_COUNT(&usable)) : 1;
}

ThreadPool::ThreadPool(int threads) : errors_(static_cast<size_t>(std::max(1, threads))) {
  try {
    for (int thread = 1; thread < threads; ++thread) {
      workers_.emplace_back([this, thread] { Work(thread); });
    }
  } catch (...) {
    Stop();
    throw;
  }
}

ThreadPool::~ThreadPool() { Stop(); }

void ThreadPool::Stop() {
  stopping_ = true;
  ++round_;
  round_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::ParallelFor(int n, const std::function<void(int)>& task) {
  if (workers_.empty() || n <= 1) {  // nobody needs to be woken
    for (int i = 0; i < n; ++i) task(i);
    return;
  }
  task_ = &task;
  n_ = n;
  next_ = 0;
  running_ = static_cast<int>(workers_.size());
  ++round_;
  round_.notify_all();
  RunTasks(0);
  for (int left = running_; left != 0; left = running_) WaitWhile(running_, left);

  // Every thread is at rest again, so errors_ is ours.
  std::exception_ptr first;
  for (std::exception_ptr& error : errors_) {
    if (!first) first = error;
    error = nullptr;
  }
  if (first) std::rethrow_exception(first);
}

void ThreadPool::Work(int thread) {
  unsigned seen = 0;
  while (true) {
    WaitWhile(round_, seen);
    ++seen;
    if (stopping_) return;
    RunTasks(thread);
    if (--running_ == 0) running_.notify_one();
  }
}

void ThreadPool::RunTasks(int thread) {
  try {
    for (int i = next_++; i < n_; i = next_++) (*task_)(i);
  } catch (...) {
    errors_[static_cast<size_t>(thread)] = std::current_exception();
  }
}

}  // namespace upswing
