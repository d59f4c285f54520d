#include "core/thread_pool.h"

#include <gtest/gtest.h>

#include <numeric>
#include <stdexcept>

namespace upswing {
namespace {

TEST(ThreadPool, RunsEveryTaskOnceWhateverTheNumberOfThreads) {
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

TEST(ThreadPool, AnExceptionReachesTheCallerAndThePoolGoesOn) {
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

}  // namespace
}  // namespace upswing
