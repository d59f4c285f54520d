#include "base/thread_pool.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstdint>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "base/wait.h"

namespace upswing {
namespace {

/// Waits until `value` differs from `old`. It spins at first, because pieces of work far shorter
/// than a millisecond follow each other closely. Then it sleeps, so that an idle pool costs
/// nothing.
void WaitWhile(const std::atomic<uint32_t>& value, uint32_t old) {
  for (int spin = 0; spin < 2000; ++spin) {
    if (value.load(std::memory_order_acquire) != old) return;
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
  }
  Wait(value, old);
}

// A ticket packs the number of tasks and the index of the next task into one number. A thread takes
// a task by compare-and-swap of the ticket. If that succeeds, the round is still running, because
// it cannot end before the task does.
constexpr int kTaskBits = 32;

}  // namespace

/// The worker threads: all threads except the caller's.
struct ThreadPool::Workers {
  explicit Workers(uint32_t count);
  ~Workers() { Stop(); }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  void ParallelFor(int n, const std::function<void(int)>& task);
  void Use(uint32_t count);
  void Stop();
  void Work(uint32_t index);
  void RunTasks();

  const std::function<void(int)>* task_ = nullptr;
  std::atomic<uint64_t> ticket_{0};      // the next task to take
  std::atomic<uint32_t> round_{0};       // increases at each ParallelFor; idle threads wait for it
  std::atomic<uint32_t> unfinished_{0};  // tasks of this round that are not done
  std::atomic<uint32_t> used_;           // workers that wait for rounds; the others sleep
  std::atomic<bool> stopping_{false};
  std::mutex error_mutex_;
  std::exception_ptr error_;
  std::vector<std::thread> threads_;
};

ThreadPool::Workers::Workers(uint32_t count) : used_(count) {
  try {
    for (uint32_t index = 0; index < count; ++index) {
      threads_.emplace_back([this, index] { Work(index); });
    }
  } catch (...) {
    Stop();
    throw;
  }
}

void ThreadPool::Workers::Stop() {
  stopping_ = true;
  Use(std::numeric_limits<uint32_t>::max());
  ++round_;
  WakeAll(round_);
  for (std::thread& thread : threads_) thread.join();
}

void ThreadPool::Workers::ParallelFor(int n, const std::function<void(int)>& task) {
  assert(unfinished_ == 0);  // fails on a call within a task
  task_ = &task;
  unfinished_ = static_cast<uint32_t>(n);
  ticket_ = static_cast<uint64_t>(n) << kTaskBits;
  ++round_;
  WakeAll(round_);
  RunTasks();
  for (uint32_t left = unfinished_; left != 0; left = unfinished_) WaitWhile(unfinished_, left);
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void ThreadPool::Workers::Use(uint32_t count) {
  if (used_.exchange(count) < count) WakeAll(used_);
}

void ThreadPool::Workers::Work(uint32_t index) {
  uint32_t seen = 0;
  while (true) {
    for (uint32_t used = used_; used <= index; used = used_) Wait(used_, used);
    WaitWhile(round_, seen);
    seen = round_;
    if (stopping_) return;
    RunTasks();
  }
}

void ThreadPool::Workers::RunTasks() {
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
    if (--unfinished_ == 0) WakeOne(unfinished_);
    ticket = ticket_;
  }
}

ThreadPool::ThreadPool(int threads, bool adapts)
    : threads_(std::max(threads, 1)), adapts_(adapts), requested_(threads_), used_(threads_) {
  if (threads_ > 1) workers_ = std::make_unique<Workers>(static_cast<uint32_t>(threads_ - 1));
}

ThreadPool::~ThreadPool() = default;

void ThreadPool::Use(int threads) {
  requested_ = threads;
  const int available = std::max(1, threads_ - lent_);
  const int used = std::min(threads, available);
  if (used_ == used) return;
  used_ = used;
  if (workers_ != nullptr) workers_->Use(static_cast<uint32_t>(used - 1));
}

void ThreadPool::Lend(int threads) {
  lent_ = threads;
  Use(requested_);
}

void ThreadPool::ParallelFor(int n, const std::function<void(int)>& task) {
  if (used_ > 1 && n > 1) return workers_->ParallelFor(n, task);
  for (int i = 0; i < n; ++i) task(i);  // no need to wake a thread
}

/// The thread of a task, and its outcome.
struct BackgroundTask::Future {
  std::atomic<bool> done{false};
  std::exception_ptr error;
  std::thread thread;  // the last member: it uses the others
};

BackgroundTask::BackgroundTask(const std::function<void()>& task)
    : future_(std::make_unique<Future>()) {
  future_->thread = std::thread([task, &future = *future_] {
    try {
      task();
    } catch (...) {
      future.error = std::current_exception();
    }
    future.done = true;
  });
}

BackgroundTask::~BackgroundTask() {
  if (future_->thread.joinable()) future_->thread.join();
}

bool BackgroundTask::done() const { return future_->done; }

void BackgroundTask::Wait() {
  future_->thread.join();
  if (future_->error) std::rethrow_exception(future_->error);
}

void ParallelFor(ThreadPool* pool, int n, const std::function<void(int)>& task) {
  if (pool != nullptr) return pool->ParallelFor(n, task);
  for (int i = 0; i < n; ++i) task(i);
}

}  // namespace upswing
