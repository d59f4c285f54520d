#include "pendulum/closed_form.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>

#include "base/rng.h"
#include "base/simd.h"
#include "base/text.h"
#include "mujoco/engines.h"
#include "mujoco/model.h"
#include "os/file.h"
#include "pendulum/pendulum_env.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

/// Allocates the result of a step of `num_envs` environments.
StepResult ResultOf(int num_envs) {
  PendulumEnvConfig config;
  config.num_envs = num_envs;
  return StepResult(PendulumSpec(config));
}

/// Calls test(path) on each SIMD path that this processor has, then selects the best path again.
template <typename Test>
void OnEachPath(const Test& test) {
  for (const std::string& path : SimdPaths()) {
    SCOPED_TRACE(path);
    UseSimdPath(path);
    test(path);
  }
  UseSimdPath(SimdPaths().front());
}

PendulumState RandomState(Rng& rng) {
  return {rng.Uniform(-4, 4), rng.Uniform(-4, 4), rng.Uniform(-8, 8), rng.Uniform(-8, 8)};
}

std::array<double, 4> StateOf(const ClosedFormBatch& batch, size_t i) {
  return {batch.q1[i], batch.q2[i], batch.w1[i], batch.w2[i]};
}

/// The state after one step of MuJoCo.
std::array<double, 4> StepOfMuJoCo(const Plant& plant, const PendulumState& s, double tau) {
  const ModelPtr model = CompileModel(plant);
  const DataPtr data(mj_makeData(model.get()));
  std::copy_n(std::array{s.q1, s.q2}.data(), 2, data->qpos);
  std::copy_n(std::array{s.w1, s.w2}.data(), 2, data->qvel);
  data->ctrl[0] = tau;
  mj_step(model.get(), data.get());
  return {data->qpos[0], data->qpos[1], data->qvel[0], data->qvel[1]};
}

/// Cancellation in det M = M11 M22 - M12²: 1/κ of the first product is left. MuJoCo subtracts the
/// products and loses the factor κ in accuracy; the closed form uses a formula for the difference.
double Cancellation(const ClosedFormBatch& batch, size_t i) {
  const double bc = batch.b[i] * std::cos(batch.q2[i]);
  const double M11 = batch.J1[i] + batch.J2[i] + 2 * bc;
  const double M12 = batch.J2[i] + bc;
  const double M22 = batch.J2[i] + batch.a[i];
  return M11 * M22 / (M11 * M22 - M12 * M12);
}

TEST(ClosedForm, StepsLikeMuJoCoOverTheWholeRangeOfPlants) {
  constexpr size_t kTrials = 500;
  ClosedFormBatch start(kTrials);
  std::vector<double> torque;
  std::vector<std::array<double, 4>> expected;
  Rng rng(2, "plants");
  for (size_t i = 0; i < kTrials; ++i) {
    const Plant plant = i % 2 == 0 ? RandomPlant(rng) : RandomMachine(rng);
    const PendulumState s = RandomState(rng);
    torque.push_back(rng.Uniform(-1.2, 1.2) * plant.torque_limit);
    start.SetPlant(i, plant);
    start.SetState(i, s);
    expected.push_back(StepOfMuJoCo(plant, s, torque.back()));
  }
  start.SetTorque(torque);
  OnEachPath([&](const std::string&) {
    ClosedFormBatch batch = start;
    Advance(batch, 1, 0, kTrials);
    for (size_t i = 0; i < kTrials; ++i) {
      double scale = 1;
      for (const double x : expected[i]) scale = std::max(scale, std::abs(x));
      // MuJoCo loses digits for links of very different length.
      const double tolerance = 1e-12 * std::max(1.0, Cancellation(start, i) / 100);
      for (size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(StateOf(batch, i)[k], expected[i][k], tolerance * scale) << i << ", " << k;
      }
    }
  });
}

TEST(ClosedForm, FollowsMuJoCosReferenceTrajectoryFor10Seconds) {
  const auto folder = std::filesystem::path(__FILE__).parent_path();
  const std::string csv = ReadOwnFile(folder / "testdata/mujoco_trajectory.csv");
  std::vector<std::array<double, 6>> rows;  // t, q1, q2, w1, w2, torque
  for (const std::string_view line : Split(Trim(csv), '\n')) {
    const auto cells = Split(line, ',');
    if (!ParseNumber(cells[0])) continue;  // the header
    for (size_t k = 0; auto& x : rows.emplace_back()) x = *ParseNumber(cells[k++]);
  }
  ASSERT_EQ(rows.size(), 501);
  OnEachPath([&](const std::string&) {
    ClosedFormBatch batch(1);
    batch.SetState(0, {rows[0][1], rows[0][2], rows[0][3], rows[0][4]});
    for (const auto& [t, q1, q2, w1, w2, torque] : rows) {
      const std::array expected{q1, q2, w1, w2};
      for (size_t k = 0; k < 4; ++k) ASSERT_NEAR(StateOf(batch, 0)[k], expected[k], 1e-9) << t;
      batch.SetTorque(std::span(&torque, 1));
      Advance(batch, 4, 0, 1);
    }
  });
}

TEST(ClosedForm, EnvironmentsOfDifferentMachinesMoveAsInMuJoCo) {
  // Models that are compiled once for all plants have rotors and dry friction written into them.
  Rng rng(5, "plants");
  PendulumEnvConfig config;
  config.num_envs = 6;
  config.plants.assign(6, Plant());
  for (size_t i = 1; i < 6; ++i) {
    config.plants[i].rotor_inertia = i % 2 == 0 ? 0 : rng.Uniform(0, 1e-3);
    config.plants[i].gear_ratio = rng.Uniform(1, 8);
    if (i > 2) config.plants[i].coulomb1 = config.plants[i].coulomb2 = 0.02;
    if (i < 4) config.plants[i].center2 = 0.2;
    if (i % 2 == 1) config.plants[i].inertia1 = 0.03;
    if (i > 3) config.plants[i].armature = rng.Uniform(0.002, 0.02);
  }
  PendulumEnv closed_form(config);
  config.engine = &kMuJoCo;
  PendulumEnv mujoco(config);
  StepResult a = closed_form.MakeResult(), b = mujoco.MakeResult();
  const std::vector<double> torque{1, -2, 3, 2, -1, 5};
  for (int step = 0; step < 25; ++step) {
    closed_form.Step(torque, a);
    mujoco.Step(torque, b);
  }
  for (int i = 0; i < 6; ++i) {
    const PendulumState p = closed_form.state(i), q = mujoco.state(i);
    EXPECT_NEAR(p.q1, q.q1, 1e-9) << i;
    EXPECT_NEAR(p.q2, q.q2, 1e-9) << i;
    EXPECT_NEAR(p.w1, q.w1, 1e-9) << i;
    EXPECT_NEAR(p.w2, q.w2, 1e-9) << i;
  }
}

TEST(ClosedForm, JudgesAsTheFormulasDo) {
  constexpr size_t kTrials = 2003;  // the last vector is not full
  ClosedFormBatch batch(kTrials);
  std::vector<Plant> plants;
  std::vector<double> torque;
  Rng rng(3, "plants");
  for (size_t i = 0; i < kTrials; ++i) {
    plants.push_back(i % 2 == 0 ? RandomPlant(rng) : RandomMachine(rng));
    torque.push_back(rng.Uniform(-1.2, 1.2) * plants[i].torque_limit);
    batch.SetPlant(i, plants[i]);
    PendulumState s = RandomState(rng);
    if (i % 4 == 0) s.q2 = rng.Uniform(0.8, 1.2) * kPi - s.q1;  // makes more states inverted
    if (i % 4 == 0) s.q1 = rng.Uniform(0.8, 1.2) * kPi;
    batch.SetState(i, s);
    batch.angle_before[i] = MotorAngle(plants[i], s) - rng.Uniform(-0.1, 0.1);
  }
  batch.SetTorque(torque);
  RewardConfig weights;
  weights.weight = {1, 0.5, 2, 3, 0.25};
  OnEachPath([&](const std::string&) {
    StepResult result = ResultOf(kTrials);
    Judge(batch, weights, 0, kTrials, result);
    for (size_t i = 0; i < kTrials; ++i) {
      const auto [q1, q2, w1, w2] = StateOf(batch, i);
      const PendulumState s{q1, q2, w1, w2};
      const double tau = std::clamp(torque[i], -plants[i].torque_limit, plants[i].torque_limit);
      const auto obs = Observe(plants[i], s);
      for (size_t k = 0; k < kObservationSize; ++k) {
        const float got = result.next_obs[i * kObservationSize + k];
        EXPECT_NEAR(got, obs[k], 1.2e-7 * std::max(1.0F, std::abs(obs[k]))) << i << ", " << k;
      }
      const auto terms = RewardTerms(plants[i], s, tau);
      double sum = 0;
      for (size_t k = 0; k < kRewardTerms; ++k) {
        const double expected = weights.weight[k] * terms[k];
        const double got = result.reward_terms[i * kRewardTerms + k];
        EXPECT_NEAR(got, expected, 1e-13 * std::max(1.0, std::abs(expected))) << i << ", " << k;
        sum += got;
      }
      EXPECT_EQ(result.reward[i], sum);
      EXPECT_EQ(result.torque[i], tau);
      EXPECT_EQ(result.work[i], std::abs(tau * (MotorAngle(plants[i], s) - batch.angle_before[i])));
      EXPECT_EQ(result.at_goal[i], Inverted(s));
      EXPECT_EQ(result.terminated[i], 0);
    }
    EXPECT_GT(std::ranges::count(result.at_goal, 1), 50);
  });
}

TEST(ClosedForm, PlaceAndNumberOfEnvironmentsChangeNoBit) {
  Rng rng(4, "plants");
  std::vector<Plant> plants(150);
  std::vector<PendulumState> states(150);
  for (size_t i = 0; i < plants.size(); ++i) {
    plants[i].mass2 = rng.Uniform(0.5, 2);
    plants[i].damping1 = rng.Uniform(0, 1);
    states[i] = RandomState(rng);
  }
  const RewardConfig weights;
  // Environments `first` to `last` of the batch, after ten control periods.
  const auto run = [&](size_t first, size_t last) {
    const size_t n = last - first;
    ClosedFormBatch batch(n);
    for (size_t i = 0; i < n; ++i) {
      batch.SetPlant(i, plants[first + i]);
      batch.SetState(i, states[first + i]);
    }
    StepResult result = ResultOf(static_cast<int>(n));
    batch.SetTorque(std::vector<double>(n, 1.5));
    Advance(batch, 40, 0, n);
    Judge(batch, weights, 0, n, result);
    return result;
  };
  std::map<std::string, StepResult> by_path;
  OnEachPath([&](const std::string& path) {
    const StepResult all = run(0, plants.size());
    for (size_t first = 0; first < plants.size(); first += 7) {
      for (const size_t n : {1, 2, 5, 8, 9, 16, 17, 23}) {
        if (first + n > plants.size()) continue;
        const StepResult some = run(first, first + n);
        for (size_t i = 0; i < n; ++i) {
          ASSERT_EQ(some.reward[i], all.reward[first + i]);
          ASSERT_EQ(some.work[i], all.work[first + i]);
          ASSERT_TRUE(
              std::equal(some.next_obs.begin(), some.next_obs.end(),
                         all.next_obs.begin() + static_cast<ptrdiff_t>(first * kObservationSize)));
        }
      }
    }
    by_path.emplace(path, all);
  });
  // All paths agree: to the bit with fused multiply-adds, closely without.
  for (const auto& [path, result] : by_path) {
    const StepResult& best = by_path.at(SimdPaths().front());
    const bool fused = path.starts_with("avx") || path == "neon";
    for (size_t i = 0; i < plants.size(); ++i) {
      EXPECT_NEAR(result.reward[i], best.reward[i], fused ? 0 : 1e-11) << path;
      EXPECT_NEAR(result.work[i], best.work[i], fused ? 0 : 1e-11) << path;
    }
  }
}

TEST(ClosedForm, NaNAndNumbersBeyondMuJoCosLimitAreBlowUps) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<PendulumState> states{{0, 0, 0, 0},    {kNan, 0, 0, 0}, {0, kNan, 0, 0},
                                          {0, 0, kNan, 0}, {0, 0, 0, kNan}, {0, 0, 0, -kInfinity},
                                          {2e10, 0, 0, 0}, {0, 0, 9e9, 0},  {0, 0, 0, -2e10}};
  const std::vector<uint8_t> expected{0, 1, 1, 1, 1, 1, 1, 0, 1};
  ClosedFormBatch batch(states.size());
  for (size_t i = 0; i < states.size(); ++i) batch.SetState(i, states[i]);
  OnEachPath([&](const std::string&) {
    StepResult result = ResultOf(static_cast<int>(states.size()));
    Judge(batch, RewardConfig(), 0, states.size(), result);
    EXPECT_EQ(result.terminated, expected);
  });
}

}  // namespace
}  // namespace upswing
