// The thread pool where there is one thread: a page's workers share nothing.
#include "base/thread_pool.h"

namespace upswing {

struct ThreadPool::Workers {};

ThreadPool::ThreadPool(int, bool) : threads_(1), adapts_(false), requested_(1), used_(1) {}

void ThreadPool::Use(int threads) { requested_ = threads; }

void ThreadPool::Lend(int threads) { lent_ = threads; }

ThreadPool::~ThreadPool() = default;

void ThreadPool::ParallelFor(int n, const std::function<void(int)>& task) {
  for (int i = 0; i < n; ++i) task(i);
}

struct BackgroundTask::Future {};

BackgroundTask::BackgroundTask(const std::function<void()>& task) { task(); }

BackgroundTask::~BackgroundTask() = default;

bool BackgroundTask::done() const { return true; }

void BackgroundTask::Wait() {}

void ParallelFor(ThreadPool* /*pool*/, int n, const std::function<void(int)>& task) {
  for (int i = 0; i < n; ++i) task(i);
}

}  // namespace upswing
