#include "core/thread_pool.h"

#include <cassert>
#include <utility>

namespace upswing {
namespace {

/// Waits until `value` differs from `old`: first spinning, as pieces of work of well under a
/// millisecond follow each other closely, then asleep, so that an idle pool costs nothing.
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

// A ticket holds the number of tasks and the index of the next one in a single number. A thread
// that takes a task by compare-and-swap of the ticket knows that the round is still running: it
// cannot end before that task does.
constexpr int kTaskBits = 32;

}  // namespace

ThreadPool::ThreadPool(int threads) {
  try {
    for (int thread = 1; thread < threads; ++thread) workers_.emplace_back([this] { Work(); });
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
  if (workers_.empty() || n <= 1) {  // no thread needs to be woken
    for (int i = 0; i < n; ++i) task(i);
    return;
  }
  assert(unfinished_ == 0);  // not from within a task
  task_ = &task;
  unfinished_ = static_cast<uint32_t>(n);
  ticket_ = static_cast<uint64_t>(n) << kTaskBits;
  ++round_;
  round_.notify_all();
  RunTasks();
  for (uint32_t left = unfinished_; left != 0; left = unfinished_) WaitWhile(unfinished_, left);
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void ThreadPool::Work() {
  uint32_t seen = 0;
  while (true) {
    WaitWhile(round_, seen);
    seen = round_;
    if (stopping_) return;
    RunTasks();
  }
}

void ThreadPool::RunTasks() {
  uint64_t ticket = ticket_;
  while (true) {
    const uint64_t tasks = ticket >> kTaskBits;
    const auto next = static_cast<uint32_t>(ticket);
    if (next >= tasks) return;
    if (!ticket_.compare_exchange_weak(ticket, ticket + 1)) continue;
    try {
      (*task_)(static_cast<int>(next));
    } catch (...) {
      const std::lock_guard lock(error_mutex_);
      if (!error_) error_ = std::current_exception();
    }
    if (--unfinished_ == 0) unfinished_.notify_one();
    ticket = ticket_;
  }
}

void ParallelFor(ThreadPool* pool, int n, const std::function<void(int)>& task) {
  if (pool != nullptr) return pool->ParallelFor(n, task);
  for (int i = 0; i < n; ++i) task(i);
}

}  // namespace upswing
