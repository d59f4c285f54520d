// The thread pool where there is one thread: a page's workers share nothing.
#include "base/thread_pool.h"

namespace upswing {

struct ThreadPool::Workers {};

ThreadPool::ThreadPool(int, bool) : threads_(1), adapts_(false), used_(1) {}

void ThreadPool::Use(int) {}

ThreadPool::~ThreadPool() = default;

void ThreadPool::ParallelFor(int n, const std::function<void(int)>& task) {
  for (int i = 0; i < n; ++i) task(i);
}

void ParallelFor(ThreadPool* /*pool*/, int n, const std::function<void(int)>& task) {
  for (int i = 0; i < n; ++i) task(i);
}

}  // namespace upswing
