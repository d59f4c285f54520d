// Properties that all Gymnasium tasks share.
#include "pendulum/gym_task.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/error.h"
#include "base/testing.h"
#include "pendulum/acrobot_v1.h"
#include "pendulum/pendulum_v1.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

struct TaskCase {
  std::string name;  // as in file names
  std::unique_ptr<VectorEnv> (*make)(const GymTaskConfig&);
  std::vector<double> start_bound, state_bound;  // (S)
  int episode_steps;
};

void PrintTo(const TaskCase& task, std::ostream* out) { *out << task.name; }

template <typename Task>
std::unique_ptr<VectorEnv> Make(const GymTaskConfig& config) {
  return std::make_unique<Task>(config);
}

class GymTasks : public testing::TestWithParam<TaskCase> {
 protected:
  static std::unique_ptr<VectorEnv> MakeEnv(const GymTaskConfig& config) {
    return GetParam().make(config);
  }
  static std::unique_ptr<VectorEnv> MakeEnv(int num_envs) {
    GymTaskConfig config;
    config.num_envs = num_envs;
    config.seed = 3;
    return MakeEnv(config);
  }
};

INSTANTIATE_TEST_SUITE_P(
    Tasks, GymTasks,
    testing::Values(TaskCase{"pendulum_v1", Make<PendulumV1>, {kPi, 1}, {kPi, 8}, 200},
                    TaskCase{"acrobot_v1",
                             Make<AcrobotV1>,
                             {0.1, 0.1, 0.1, 0.1},
                             {kPi, kPi, 4 * kPi, 9 * kPi},
                             500}),
    [](const auto& info) { return info.param.name; });

/// The state of an environment.
std::vector<double> StateOf(const VectorEnv& env, int i) {
  std::vector<double> state(env.spec().state_names.size());
  env.GetState(i, state);
  return state;
}

/// One step under a torque for each environment.
void Step(VectorEnv& env, std::vector<double> torque, StepResult& result) {
  env.Step({torque.data(), env.num_envs(), 1}, result);
}

TEST_P(GymTasks, SpecIsComplete) {
  const EnvSpec spec = MakeEnv(2)->spec();
  EXPECT_EQ(spec.num_envs, 2);
  EXPECT_EQ(spec.action_size(), 1);
  EXPECT_EQ(spec.mirror_signs.size(), static_cast<size_t>(spec.obs_size));
  EXPECT_EQ(spec.state_names.size(), GetParam().state_bound.size());
  EXPECT_EQ(spec.state_units.size(), spec.state_names.size());
  EXPECT_TRUE(spec.evaluation.by_return());
  EXPECT_DOUBLE_EQ(spec.evaluation.seconds, GetParam().episode_steps * spec.step_seconds);
  EXPECT_EQ(spec.evaluation.return_seconds, spec.evaluation.seconds);
}

TEST_P(GymTasks, MirroredStatesAndTorquesStayMirroredBitForBit) {
  constexpr int kEnvs = 200;
  const auto env = MakeEnv(kEnvs), mirrored = MakeEnv(kEnvs);
  const EnvSpec spec = env->spec();
  Rng rng(1, "mirror");
  std::vector<double> torque;
  for (int i = 0; i < kEnvs; ++i) {
    std::vector<double> state;
    for (const double bound : GetParam().state_bound) state.push_back(rng.Uniform(-bound, bound));
    env->SetState(i, state);
    for (double& x : state) x = -x;
    mirrored->SetState(i, state);
    torque.push_back(rng.Uniform(-3, 3));
  }
  StepResult a(spec), b(spec);
  Step(*env, torque, a);
  for (double& u : torque) u = -u;
  Step(*mirrored, torque, b);
  EXPECT_EQ(a.reward_terms, b.reward_terms);
  EXPECT_EQ(a.work, b.work);
  EXPECT_EQ(a.at_goal, b.at_goal);
  EXPECT_EQ(a.terminated, b.terminated);
  for (size_t i = 0; i < a.next_obs.size(); ++i) {
    const float sign = spec.mirror_signs[i % spec.mirror_signs.size()];
    ASSERT_EQ(a.next_obs[i], sign * b.next_obs[i]) << i;
  }
  for (int i = 0; i < kEnvs; ++i) {
    if (a.done(static_cast<size_t>(i))) continue;
    ASSERT_EQ(a.torque[static_cast<size_t>(i)], -b.torque[static_cast<size_t>(i)]);
    const std::vector<double> s = StateOf(*env, i), t = StateOf(*mirrored, i);
    for (size_t k = 0; k < s.size(); ++k) ASSERT_EQ(s[k], -t[k]);
  }
}

TEST_P(GymTasks, StartsAreUniformWithinTheirBounds) {
  constexpr int kEnvs = 2000;
  const auto env = MakeEnv(kEnvs);
  for (size_t k = 0; k < GetParam().start_bound.size(); ++k) {
    const double bound = GetParam().start_bound[k];
    double mean = 0, square = 0;
    for (int i = 0; i < kEnvs; ++i) {
      const double x = StateOf(*env, i)[k] / bound;
      ASSERT_LE(std::abs(x), 1);
      mean += x / kEnvs;
      square += x * x / kEnvs;
    }
    // Uniform in ±1: mean 0 ± 0.58/√N, mean square 1/3 ± 0.30/√N; five deviations each.
    EXPECT_NEAR(mean, 0, 5 * 0.58 / std::sqrt(kEnvs));
    EXPECT_NEAR(square, 1.0 / 3, 5 * 0.30 / std::sqrt(kEnvs));
  }
}

TEST_P(GymTasks, TruncatesAtTheTimeLimitWithTheTrueSuccessorAndThenResets) {
  const auto env = MakeEnv(2), reference = MakeEnv(2);
  StepResult result(env->spec()), expected(env->spec());
  for (int step = 1; step < GetParam().episode_steps; ++step) {
    Step(*env, {0, 0.01}, result);
    ASSERT_FALSE(result.done(0) || result.done(1)) << step;
  }
  // A second set of environments in the same states, with episodes that have just begun.
  for (int i = 0; i < 2; ++i) reference->SetState(i, StateOf(*env, i));
  Step(*env, {0, 0.01}, result);
  Step(*reference, {0, 0.01}, expected);
  EXPECT_EQ(result.next_obs, expected.next_obs);
  EXPECT_EQ(result.truncated, (std::vector<uint8_t>{1, 1}));
  EXPECT_EQ(result.terminated, (std::vector<uint8_t>{0, 0}));
  EXPECT_EQ(expected.truncated, (std::vector<uint8_t>{0, 0}));
  EXPECT_FALSE(std::ranges::equal(env->obs().values(), std::span<const float>(result.next_obs)));
  for (size_t k = 0; k < GetParam().start_bound.size(); ++k) {
    EXPECT_LE(std::abs(StateOf(*env, 0)[k]), GetParam().start_bound[k]);
  }
  Step(*env, {0, 0.01}, result);
  EXPECT_EQ(result.truncated, (std::vector<uint8_t>{0, 0}));
}

TEST_P(GymTasks, APartOfTheEnvironmentsIsAsThoseOfTheWhole) {
  GymTaskConfig config;
  config.num_envs = 5;
  const auto whole = MakeEnv(config);
  config.num_envs = 2;
  config.first_index = 2;
  const auto part = MakeEnv(config);
  StepResult expected(whole->spec()), result(part->spec());
  for (int step = 0; step < GetParam().episode_steps + 10; ++step) {  // past a reset
    const double u = std::sin(step);
    Step(*whole, {0, 1, u, -u, 2}, expected);
    Step(*part, {u, -u}, result);
    for (int i = 0; i < 2; ++i) {
      ASSERT_TRUE(std::ranges::equal(whole->obs().row(i + 2), part->obs().row(i)));
      ASSERT_EQ(StateOf(*whole, i + 2), StateOf(*part, i));
      ASSERT_EQ(expected.reward[static_cast<size_t>(i) + 2], result.reward[static_cast<size_t>(i)]);
    }
  }
}

TEST_P(GymTasks, SavedAndLoadedGoesOnWithTheSameBits) {
  const auto saved = MakeEnv(3);
  GymTaskConfig other;
  other.num_envs = 3;
  other.seed = 9;
  const auto loaded = MakeEnv(other);
  StepResult a(saved->spec()), b(saved->spec());
  for (int step = 0; step < 100; ++step) Step(*saved, {1, -1, 0.5}, a);
  SaveAndLoad([&](const Archive& archive) { saved->State(archive); },
              [&](const Archive& archive) { loaded->State(archive); });
  EXPECT_TRUE(std::ranges::equal(saved->obs().values(), loaded->obs().values()));
  for (int step = 0; step < GetParam().episode_steps; ++step) {  // past a reset
    Step(*saved, {1, -1, 0.5}, a);
    Step(*loaded, {1, -1, 0.5}, b);
    ASSERT_EQ(a.next_obs, b.next_obs);
    ASSERT_EQ(a.reward, b.reward);
    ASSERT_EQ(a.truncated, b.truncated);
    ASSERT_TRUE(std::ranges::equal(saved->obs().values(), loaded->obs().values()));
  }
}

/// Whether an environment accepts its own state with one array replaced.
template <typename T>
bool Takes(std::unique_ptr<VectorEnv> env, const std::string& name, std::vector<T> values) {
  try {
    SaveAndLoad(
        [&](const Archive& archive) {
          env->State(archive);
          archive.Array(name, std::span(values), kAnyNumber<T>);
        },
        [&](const Archive& archive) { env->State(archive); });
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 2) << error.what();
    EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    return false;
  }
  return true;
}

TEST_P(GymTasks, StatesThatNoTrainingReachesAreNotLoaded) {
  for (size_t k = 0; k < GetParam().state_bound.size(); ++k) {
    const std::string name = MakeEnv(2)->spec().state_names[k];
    const double bound = GetParam().state_bound[k];
    EXPECT_TRUE(Takes<double>(MakeEnv(2), name, {-bound, bound}));
    EXPECT_FALSE(Takes<double>(MakeEnv(2), name, {0, std::nextafter(bound, 100)}));
    EXPECT_FALSE(Takes<double>(MakeEnv(2), name, {0}));
  }
  const int64_t steps = GetParam().episode_steps;
  EXPECT_TRUE(Takes<int64_t>(MakeEnv(2), "step_counts", {0, steps - 1}));
  EXPECT_FALSE(Takes<int64_t>(MakeEnv(2), "step_counts", {0, steps}));
  EXPECT_FALSE(Takes<int64_t>(MakeEnv(2), "step_counts", {-1, 0}));
}

TEST_P(GymTasks, StatesBeyondTheirBoundsCannotBeSet) {
  const auto env = MakeEnv(1);
  const std::vector<double>& bound = GetParam().state_bound;
  for (size_t k = 0; k < bound.size(); ++k) {
    std::vector<double> state = bound;
    env->SetState(0, state);
    EXPECT_EQ(StateOf(*env, 0), bound);
    for (const double bad : {std::nextafter(bound[k], 100), -1e300, std::nan("")}) {
      state[k] = bad;
      EXPECT_THROW(env->SetState(0, state), Error);
      EXPECT_EQ(StateOf(*env, 0), bound);  // unchanged
    }
  }
}

TEST_P(GymTasks, TheFastestStatesStayWithinTheirBounds) {
  const auto env = MakeEnv(1);
  const std::vector<double>& bound = GetParam().state_bound;
  StepResult result(env->spec());
  Rng rng(2, "corners");
  for (int trial = 0; trial < 1000; ++trial) {
    std::vector<double> state = bound;
    for (double& x : state) x = rng.Below(2) == 0 ? x : -x;
    state[0] = rng.Uniform(-kPi, kPi);
    env->SetState(0, state);
    Step(*env, {rng.Uniform(-9, 9)}, result);
    for (size_t k = 0; k < bound.size(); ++k) {
      ASSERT_LE(std::abs(StateOf(*env, 0)[k]), bound[k]);
    }
  }
}

}  // namespace
}  // namespace upswing
