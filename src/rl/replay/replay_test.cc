#include "rl/replay/replay.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

#include "base/error.h"
#include "base/testing.h"
#include "rl/replay/mirror.h"

namespace upswing {
namespace {

/// Transition number i, with two numbers per observation.
struct Numbered {
  std::array<float, 2> obs, next_obs;
  float action;
  Transition transition;
  explicit Numbered(int i)
      : obs{static_cast<float>(i), 1},
        next_obs{static_cast<float>(i), 2},
        action(static_cast<float>(i % 9)),
        transition{obs, next_obs, std::span(&action, 1), static_cast<float>(10 * i), 0.5F} {}
};

const ActionSpace kNineActions = ActionSpace::Discrete(9);

TEST(Replay, KeepsTheNewest) {
  Replay replay(5, 2, kNineActions);
  for (int i = 0; i < 12; ++i) replay.Add(Numbered(i).transition);
  EXPECT_EQ(replay.size(), 5);
  std::set<float> kept;
  for (int i = 0; i < 5; ++i) kept.insert(replay.at(i).obs[0]);
  EXPECT_EQ(kept, (std::set<float>{7, 8, 9, 10, 11}));
}

TEST(Replay, SamplesWholeTransitionsEvenly) {
  Replay replay(10, 2, kNineActions);
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
      EXPECT_EQ(batch.action[i], static_cast<float>(number % 9));
      EXPECT_EQ(batch.reward[i], static_cast<float>(10 * number));
      EXPECT_EQ(batch.discount[i], 0.5F);
    }
  }
  for (const int c : count) EXPECT_NEAR(c, 64 * rounds / 10.0, 5 * std::sqrt(64 * rounds / 10.0));
}

TEST(Replay, AMillionTransitionsOfThePendulumFitIn100Megabytes) {
  // A full memory writes all of its numbers to the checkpoint.
  constexpr size_t kRow = (2 * 8 + 3) * sizeof(float);
  Replay replay(1000, 8, kNineActions);
  const std::array<float, 8> obs{};
  for (int i = 0; i < 1000; ++i) replay.Add({obs, obs, std::span(obs).first(1), 0, 0});
  Tensors file;
  replay.State(Archive::Saver(file));
  EXPECT_EQ(file.all().at("rows").bytes.size(), 1000 * kRow);
  EXPECT_LE(1000000 * kRow, 100000000U);
}

TEST(Replay, DrawsByPriorityAndWeighsAsThePaperDoes) {
  ThreadPool pool(2);
  Replay replay(4, 2, kNineActions, true);
  for (int i = 0; i < 4; ++i) replay.Add(Numbered(i).transition);
  // Before any update, all transitions have the same probability and weight 1.
  Rng rng(1, "replay test");
  Minibatch batch(4, 2);
  replay.SamplePrioritized(rng, 0.5, pool, batch);
  EXPECT_EQ(batch.index, (std::vector<int64_t>{0, 1, 2, 3}));
  EXPECT_EQ(batch.weight[2], 1);

  // α = 1/2: priorities of 1, 2, 3, 4 from |TD errors| of 1, 4, 9, 16.
  replay.Prioritize(batch, std::vector<float>{1, -4, 9, -16}, 0.5);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(replay.priority(i), i + 1, 1e-6);
  std::array<int, 4> count{};
  constexpr int rounds = 10000;
  constexpr double beta = 0.7;
  for (int round = 0; round < rounds; ++round) {
    replay.SamplePrioritized(rng, beta, pool, batch);
    double largest = 0;
    for (const int64_t i : batch.index) largest = std::max(largest, std::pow(i + 1, -beta));
    for (size_t i = 0; i < 4; ++i) {
      ++count.at(static_cast<size_t>(batch.index[i]));
      const double p = static_cast<double>(batch.index[i] + 1);
      ASSERT_NEAR(batch.weight[i], std::pow(p, -beta) / largest, 1e-6);
      ASSERT_EQ(batch.obs[2 * i], static_cast<float>(batch.index[i]));
    }
  }
  for (size_t i = 0; i < 4; ++i) {
    const double expected = rounds * 4 * static_cast<double>(i + 1) / 10;
    EXPECT_NEAR(count.at(i), expected, 5 * std::sqrt(expected));
  }
}

TEST(Replay, ANewTransitionHasTheLargestPrioritySoFar) {
  Replay replay(3, 2, kNineActions, true);
  for (int i = 0; i < 3; ++i) replay.Add(Numbered(i).transition);
  Minibatch batch(3, 2);
  batch.index = {0, 1, 2};
  replay.Prioritize(batch, std::vector<float>{0.1F, 8, 0.2F}, 1);
  replay.Prioritize(batch, std::vector<float>{0.1F, 0.3F, 0.2F}, 1);
  replay.Add(Numbered(3).transition);  // replaces the oldest transition
  EXPECT_NEAR(replay.priority(0), 8, 1e-5);
  EXPECT_NEAR(replay.priority(1), 0.3, 1e-5);
}

TEST(Replay, LoadedPrioritiesDrawTheSame) {
  ThreadPool pool(2);
  Replay saved(5, 2, kNineActions, true), loaded(5, 2, kNineActions, true);
  for (int i = 0; i < 7; ++i) saved.Add(Numbered(i).transition);
  Minibatch batch(3, 2), other(3, 2);
  batch.index = {0, 2, 4};
  saved.Prioritize(batch, std::vector<float>{3, 0.5F, 0.01F}, 0.6);
  SaveAndLoad([&](const Archive& archive) { saved.State(archive); },
              [&](const Archive& archive) { loaded.State(archive); });
  for (Replay* replay : {&saved, &loaded}) replay->Add(Numbered(7).transition);
  Rng rng(1, "replay test"), other_rng(1, "replay test");
  for (int round = 0; round < 100; ++round) {
    saved.SamplePrioritized(rng, 0.5, pool, batch);
    loaded.SamplePrioritized(other_rng, 0.5, pool, other);
    ASSERT_EQ(batch.index, other.index);
    ASSERT_EQ(batch.weight, other.weight);
  }
}

TEST(Replay, LoadedStateContinuesAsTheSavedOne) {
  Replay saved(5, 2, kNineActions), loaded(5, 2, kNineActions);
  for (int i = 0; i < 7; ++i) saved.Add(Numbered(i).transition);
  SaveAndLoad([&](const Archive& archive) { saved.State(archive); },
              [&](const Archive& archive) { loaded.State(archive); });
  saved.Add(Numbered(7).transition);
  loaded.Add(Numbered(7).transition);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(saved.at(i).reward, loaded.at(i).reward);
}

TEST(Replay, KeepsActionsOfSeveralNumbersAndMirrorsThem) {
  const ActionSpace torques{2};
  Replay replay(3, 1, torques);
  const float obs = 7, next_obs = 8;
  const std::array<float, 2> action{0.25F, -1};
  replay.Add({std::span(&obs, 1), std::span(&next_obs, 1), action, 9, 0.5F});
  Rng rng(1, "replay test");
  Minibatch batch(16, 1, 2);
  replay.Sample(rng, batch);
  const Minibatch before = batch;
  MirrorHalf(rng, std::vector<float>{-1}, torques, batch);
  int turned = 0;
  for (size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(before.action[2 * i], 0.25F);
    EXPECT_EQ(before.action[2 * i + 1], -1);
    EXPECT_EQ(batch.reward[i], 9);
    const float side = batch.obs[i] / before.obs[i];
    EXPECT_EQ(std::abs(side), 1);
    EXPECT_EQ(batch.next_obs[i], side * 8);
    EXPECT_EQ(batch.action[2 * i], side * 0.25F);
    EXPECT_EQ(batch.action[2 * i + 1], -side);
    if (side < 0) ++turned;
  }
  EXPECT_GT(turned, 0);
  EXPECT_LT(turned, 16);
}

TEST(Replay, RefusesActionsThatTheAgentDoesNotHave) {
  Replay saved(5, 2, kNineActions), loaded(5, 2, ActionSpace::Discrete(3)),
      torque(5, 2, ActionSpace{1});
  for (int i = 0; i < 4; ++i) saved.Add(Numbered(i).transition);
  for (Replay* other : {&loaded, &torque}) {
    EXPECT_THROW(SaveAndLoad([&](const Archive& archive) { saved.State(archive); },
                             [&](const Archive& archive) { other->State(archive); }),
                 Error);
  }
}

}  // namespace
}  // namespace upswing
