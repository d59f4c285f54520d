#include "rl/replay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/testing.h"

namespace upswing {
namespace {

/// Transition number i of two observations each.
struct Numbered {
  std::array<float, 2> obs, next_obs;
  Transition transition;
  explicit Numbered(int i)
      : obs{static_cast<float>(i), 1},
        next_obs{static_cast<float>(i), 2},
        transition{obs, next_obs, i % 9, static_cast<float>(10 * i), 0.5F} {}
};

TEST(Replay, KeepsTheNewest) {
  Replay replay(5, 2);
  for (int i = 0; i < 12; ++i) replay.Add(Numbered(i).transition);
  EXPECT_EQ(replay.size(), 5);
  std::set<float> kept;
  for (int i = 0; i < 5; ++i) kept.insert(replay.at(i).obs[0]);
  EXPECT_EQ(kept, (std::set<float>{7, 8, 9, 10, 11}));
}

TEST(Replay, SamplesWholeTransitionsEvenly) {
  Replay replay(10, 2);
  for (int i = 0; i < 10; ++i) replay.Add(Numbered(i).transition);
  Rng rng(1, "replay test");
  Minibatch batch(64, 2);
  std::array<int, 10> count{};
  constexpr int rounds = 1000;
  for (int round = 0; round < rounds; ++round) {
    replay.Sample(rng, batch);
    for (size_t i = 0; i < 64; ++i) {
      const int number = static_cast<int>(batch.obs[2 * i]);
      ++count.at(static_cast<size_t>(number));
      EXPECT_EQ(batch.obs[2 * i + 1], 1);
      EXPECT_EQ(batch.next_obs[2 * i], static_cast<float>(number));
      EXPECT_EQ(batch.next_obs[2 * i + 1], 2);
      EXPECT_EQ(batch.action[i], number % 9);
      EXPECT_EQ(batch.reward[i], static_cast<float>(10 * number));
      EXPECT_EQ(batch.discount[i], 0.5F);
    }
  }
  for (const int c : count) EXPECT_NEAR(c, 64 * rounds / 10.0, 5 * std::sqrt(64 * rounds / 10.0));
}

TEST(Replay, AMillionTransitionsOfThePendulumFitIn100Megabytes) {
  // What a full memory writes to the checkpoint is what it holds.
  constexpr size_t kRow = (2 * 8 + 3) * sizeof(float);
  Replay replay(1000, 8);
  const std::array<float, 8> obs{};
  for (int i = 0; i < 1000; ++i) replay.Add({obs, obs, 0, 0, 0});
  TensorFile file;
  replay.State(Archive::Saver(file), 9);
  EXPECT_EQ(file.tensors().at("rows").bytes.size(), 1000 * kRow);
  EXPECT_LE(1000000 * kRow, 100000000U);
}

TEST(Replay, LoadedGoesOnLikeSaved) {
  Replay saved(5, 2), loaded(5, 2);
  for (int i = 0; i < 7; ++i) saved.Add(Numbered(i).transition);
  SaveAndLoad([&](const Archive& archive) { saved.State(archive, 9); },
              [&](const Archive& archive) { loaded.State(archive, 9); });
  saved.Add(Numbered(7).transition);
  loaded.Add(Numbered(7).transition);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(saved.at(i).reward, loaded.at(i).reward);
}

}  // namespace
}  // namespace upswing
