#include "base/thread_tuner.h"

#include <gtest/gtest.h>

#include <cmath>

namespace upswing {
namespace {

/// A tuner on a clock that the test controls: a call on t threads takes seconds(t).
class TunedWork {
 public:
  explicit TunedWork(int threads, std::function<double(int)> seconds)
      : pool_(threads, true), seconds_(std::move(seconds)) {}

  void Run(int calls) {
    for (int call = 0; call < calls; ++call) {
      tuner_.Run([&] { now_ += seconds_(pool_.used()); });
    }
  }
  int threads() const { return tuner_.threads(); }
  double now() const { return now_; }
  void Set(std::function<double(int)> seconds) { seconds_ = std::move(seconds); }
  void Lend(int threads) { pool_.Lend(threads); }
  int used() const { return pool_.used(); }

 private:
  double now_ = 0;
  ThreadPool pool_;
  ThreadTuner tuner_{&pool_, [this] { return now_; }};
  std::function<double(int)> seconds_;
};

TEST(ThreadTuner, TakesAllThreadsWhereWorkScales) {
  TunedWork work(8, [](int threads) { return 1e-3 / threads; });
  work.Run(1000);
  EXPECT_EQ(work.threads(), 8);
}

TEST(ThreadTuner, StaysOnOneThreadWhereMoreAreSlowerAndLosesUnderOnePercent) {
  TunedWork work(8, [](int threads) { return threads == 1 ? 1e-4 : 2e-4; });
  constexpr int kCalls = 20000;
  work.Run(kCalls);
  EXPECT_EQ(work.threads(), 1);
  EXPECT_LT(work.now(), 1.01 * kCalls * 1e-4);
}

TEST(ThreadTuner, FindsTheFastestNumberInBetween) {
  // Amdahl's law with a cost per thread. Four threads are fastest.
  TunedWork work(8, [](int t) { return 1e-4 * (0.2 + 0.8 / t + 0.04 * t); });
  work.Run(2000);
  EXPECT_EQ(work.threads(), 4);
}

TEST(ThreadTuner, FollowsAMachineThatGetsBusyAndIdleAgain) {
  const auto idle = [](int threads) { return 1e-3 / threads; };
  TunedWork work(2, idle);
  work.Run(1000);
  EXPECT_EQ(work.threads(), 2);
  work.Set([](int threads) { return threads == 1 ? 1e-3 : 3e-3; });
  work.Run(5000);
  EXPECT_EQ(work.threads(), 1);
  work.Set(idle);
  work.Run(10000);
  EXPECT_EQ(work.threads(), 2);
}

TEST(ThreadTuner, CallsOfAlternatingLengthDoNotMislead) {
  // Every second call takes ten times as long, as for an agent whose actor learns in every second
  // update.
  int call = 0;
  TunedWork work(
      2, [&](int threads) { return (call++ % 2 == 0 ? 1e-4 : 1e-3) * (threads == 1 ? 1 : 1.5); });
  work.Run(5000);
  EXPECT_EQ(work.threads(), 1);
}

TEST(ThreadTuner, ChoosesAgainWhileThreadsAreLent) {
  // Four threads are fastest. Of the rest, where four are lent, three are.
  TunedWork work(7, [](int t) { return 1e-4 * (0.2 + 0.8 / t + 0.04 * t); });
  work.Lend(4);
  for (int i = 0; i < 20; ++i) {  // as evaluations in the background begin and end
    work.Run(50);
    EXPECT_LE(work.used(), 3);
    work.Lend(0);
    work.Run(50);
    work.Lend(4);
  }
  EXPECT_EQ(work.threads(), 3);
  work.Lend(0);
  EXPECT_EQ(work.threads(), 4);
}

TEST(ThreadTuner, KeepsAFixedPool) {
  ThreadPool pool(3);
  ThreadTuner tuner(&pool);
  for (int call = 0; call < 100; ++call) {
    tuner.Run([&] { EXPECT_EQ(pool.used(), 3); });
  }
}

}  // namespace
}  // namespace upswing
