#include "base/thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <stdexcept>
#include <thread>

#include "base/testing.h"

namespace upswing {
namespace {

TEST(ThreadPool, RunsEveryTaskOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 3, 8}) {
    ThreadPool pool(threads);
    EXPECT_EQ(pool.threads(), threads);
    for (int round = 0; round < 500; ++round) {
      std::vector<int> calls(static_cast<size_t>(round % 17));
      pool.ParallelFor(round % 17, [&](int i) { ++calls[static_cast<size_t>(i)]; });
      for (const int count : calls) ASSERT_EQ(count, 1);
    }
  }
}

TEST(ThreadPool, ManyShortRoundsWithMoreThreadsThanProcessors) {
  const OnOneProcessor one;
  ThreadPool pool(8);
  const auto caller = std::this_thread::get_id();
  std::atomic<int> by_others{0};
  for (int round = 0; round < 500; ++round) {
    const int n = 2 + round % 5;
    std::vector<int> done(static_cast<size_t>(n), -1);  // destroyed at the end of the round
    pool.ParallelFor(n, [&](int i) {
      // Without it, the caller may run all tasks before other threads wake.
      std::this_thread::yield();
      done[static_cast<size_t>(i)] = round;
      by_others += std::this_thread::get_id() != caller ? 1 : 0;
    });
    for (const int last : done) ASSERT_EQ(last, round);
  }
  EXPECT_GT(by_others, 0);
}

TEST(ThreadPool, RunsEveryTaskOnceWhileTheThreadsInUseChange) {
  ThreadPool pool(4);
  for (int round = 0; round < 500; ++round) {
    pool.Use(1 + round * 7 % 4);
    std::vector<int> calls(9);
    pool.ParallelFor(9, [&](int i) { ++calls[static_cast<size_t>(i)]; });
    for (const int count : calls) ASSERT_EQ(count, 1);
  }
}

TEST(ThreadPool, SumsInAFixedOrderHaveTheSameBits) {
  const auto sum = [](int threads) {
    ThreadPool pool(threads);
    std::vector<float> parts(7);
    pool.ParallelFor(7, [&](int i) {
      for (int k = 1; k < 10000; ++k)
        parts[static_cast<size_t>(i)] += 1.0F / static_cast<float>(k + i);
    });
    return std::accumulate(parts.begin(), parts.end(), 0.0F);
  };
  EXPECT_EQ(sum(1), sum(2));
  EXPECT_EQ(sum(1), sum(4));
}

TEST(ThreadPool, AnExceptionReachesTheCallerAndThePoolStaysUsable) {
  ThreadPool pool(2);
  for (const int bad : {0, 1}) {
    EXPECT_THROW(pool.ParallelFor(4,
                                  [&](int i) {
                                    if (i == bad) throw std::runtime_error("task");
                                  }),
                 std::runtime_error);
  }
  std::atomic<int> calls{0};
  pool.ParallelFor(4, [&](int) { ++calls; });
  EXPECT_EQ(calls, 4);
}

TEST(ThreadPool, OfTwoExceptionsOneReachesTheCallerAndNoneIsLeft) {
  ThreadPool pool(3);
  for (int round = 0; round < 200; ++round) {
    std::atomic<int> calls{0};
    EXPECT_THROW(pool.ParallelFor(6,
                                  [&](int i) {
                                    ++calls;
                                    if (i == 1 || i == 2) throw std::runtime_error("task");
                                  }),
                 std::runtime_error);
    EXPECT_EQ(calls, 6);  // the other tasks run despite the exceptions
    calls = 0;
    EXPECT_NO_THROW(pool.ParallelFor(6, [&](int) { ++calls; }));
    EXPECT_EQ(calls, 6);
  }
}

TEST(ThreadPool, LentThreadsTakeNoTasks) {
  ThreadPool pool(3);
  pool.Lend(1);
  EXPECT_EQ(pool.used(), 2);
  pool.Use(3);
  EXPECT_EQ(pool.used(), 2);
  pool.Use(1);
  pool.Lend(2);
  EXPECT_EQ(pool.used(), 1);
  pool.Use(2);
  pool.Lend(0);  // the last request counts again
  EXPECT_EQ(pool.used(), 2);

  ThreadPool alone(1);
  alone.Lend(1);
  EXPECT_EQ(alone.used(), 1);
  int done = 0;
  alone.ParallelFor(5, [&](int) { ++done; });
  EXPECT_EQ(done, 5);
}

TEST(BackgroundTask, RunsWhileTheCallerGoesOn) {
  std::atomic<bool> may_end = false;
  std::atomic<int> result = 0;
  BackgroundTask task([&] {
    may_end.wait(false);
    result = 7;
  });
  EXPECT_FALSE(task.done());
  may_end = true;
  may_end.notify_all();
  task.Wait();
  EXPECT_EQ(result, 7);
  { const BackgroundTask waited([&] { result = 8; }); }
  EXPECT_EQ(result, 8);
}

TEST(BackgroundTask, WaitThrowsItsException) {
  BackgroundTask task([] { throw std::runtime_error("enough"); });
  EXPECT_THROW(task.Wait(), std::runtime_error);
}

}  // namespace
}  // namespace upswing
