#include "rl/replay/n_step.h"

#include <gtest/gtest.h>

#include "base/testing.h"

namespace upswing {
namespace {

const ActionSpace kNine = ActionSpace::Discrete(9);

/// A copy of a transition.
struct Emitted {
  float obs, next_obs;
  float action;
  double reward, discount;
  bool operator==(const Emitted&) const = default;
};

/// Pushes step i of an environment: observation 10·env + i, action i, reward 2^i, next i + 1.
/// `gamma` is the discount of a step.
void PushStep(NStep& n_step, int env, int i, bool terminated, bool truncated,
              std::vector<Emitted>& out, double gamma = 0.5) {
  const float obs = static_cast<float>(10 * env + i);
  const float next = obs + 1, action = static_cast<float>(i);
  Replay replay(10, 1, kNine);
  n_step.Push(env,
              {std::span(&obs, 1), std::span(&next, 1), std::span(&action, 1),
               static_cast<double>(1 << i), terminated ? 0 : gamma},
              terminated || truncated, replay);
  for (int64_t k = 0; k < replay.size(); ++k) {
    const Transition t = replay.at(k);
    out.push_back({t.obs[0], t.next_obs[0], t.action[0], t.reward, t.discount});
  }
}

TEST(NStep, OneStepPassesThrough) {
  NStep n_step(1, 1, 1, kNine);
  std::vector<Emitted> out;
  PushStep(n_step, 0, 0, false, false, out);
  PushStep(n_step, 0, 1, false, true, out);
  PushStep(n_step, 0, 2, true, false, out);
  EXPECT_EQ(out, (std::vector<Emitted>{{0, 1, 0, 1, 0.5}, {1, 2, 1, 2, 0.5}, {2, 3, 2, 4, 0}}));
}

TEST(NStep, ThreeStepsAndTheShorterRestAtATruncation) {
  // γ = 0.5, rewards 1, 2, 4, 8. Full windows: 1 + 2/2 + 4/4 = 3 and 2 + 4/2 + 8/4 = 6, both with
  // γ³. Tails: 4 + 8/2 = 8 with γ², and 8 with γ. The tails and the last window bootstrap from the
  // last observation.
  NStep n_step(1, 3, 1, kNine);
  std::vector<Emitted> out;
  for (int i = 0; i < 3; ++i) PushStep(n_step, 0, i, false, false, out);
  EXPECT_EQ(out, (std::vector<Emitted>{{0, 3, 0, 3, 0.125}}));
  PushStep(n_step, 0, 3, false, true, out);
  EXPECT_EQ(out,
            (std::vector<Emitted>{
                {0, 3, 0, 3, 0.125}, {1, 4, 1, 6, 0.125}, {2, 4, 2, 8, 0.25}, {3, 4, 3, 8, 0.5}}));
}

TEST(NStep, ATerminationBootstrapsFromNothing) {
  NStep n_step(1, 3, 1, kNine);
  std::vector<Emitted> out;
  PushStep(n_step, 0, 0, false, false, out);
  PushStep(n_step, 0, 1, true, false, out);
  EXPECT_EQ(out, (std::vector<Emitted>{{0, 2, 0, 2, 0}, {1, 2, 1, 2, 0}}));
}

TEST(NStep, ALateTruncationEqualsOneAtTheLastStep) {
  NStep late(1, 3, 1, kNine), at_once(1, 3, 1, kNine);
  std::vector<Emitted> out;
  for (int i = 0; i < 2; ++i) PushStep(late, 0, i, false, false, out);
  const float next = 2;
  Replay replay(10, 1, kNine);
  late.Truncate(0, std::span(&next, 1), replay);
  for (int64_t k = 0; k < replay.size(); ++k) {
    const Transition t = replay.at(k);
    out.push_back({t.obs[0], t.next_obs[0], t.action[0], t.reward, t.discount});
  }
  std::vector<Emitted> expected;
  for (int i = 0; i < 2; ++i) PushStep(at_once, 0, i, false, i == 1, expected);
  EXPECT_EQ(out, expected);
  EXPECT_EQ(late.waiting(), 0);
}

TEST(NStep, EpisodesAndEnvironmentsDoNotMix) {
  NStep n_step(2, 2, 1, kNine);
  std::vector<Emitted> out;
  PushStep(n_step, 0, 0, false, false, out);
  PushStep(n_step, 1, 0, false, false, out);
  EXPECT_TRUE(out.empty());
  PushStep(n_step, 0, 1, false, true, out);  // ends environment 0: a window and a tail
  EXPECT_EQ(out.size(), 2U);
  PushStep(n_step, 0, 2, false, false, out);  // a new episode waits for its second step
  EXPECT_EQ(out.size(), 2U);
  PushStep(n_step, 1, 1, false, false, out);
  EXPECT_EQ(out.back(), (Emitted{10, 12, 0, 2, 0.25}));
}

TEST(NStep, LoadedStateContinuesAsTheSavedOne) {
  NStep saved(2, 3, 1, kNine), loaded(2, 3, 1, kNine);
  std::vector<Emitted> a, b;
  for (int i = 0; i < 4; ++i) PushStep(saved, i % 2, i, false, false, a, 0.9);
  SaveAndLoad([&](const Archive& archive) { saved.State(archive); },
              [&](const Archive& archive) { loaded.State(archive); });
  a.clear();
  PushStep(saved, 1, 5, false, true, a, 0.9);
  PushStep(loaded, 1, 5, false, true, b, 0.9);
  EXPECT_EQ(a, b);
  EXPECT_EQ(a.size(), 3U);
}

}  // namespace
}  // namespace upswing
