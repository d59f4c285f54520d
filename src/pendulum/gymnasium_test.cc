// Compares the Gymnasium tasks with Gymnasium's own trajectories (testdata/make_gymnasium.py).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "base/csv.h"
#include "base/error.h"
#include "base/text.h"
#include "pendulum/acrobot_v1.h"
#include "pendulum/pendulum_v1.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

/// The columns of a file by name; each row is one step.
using Table = std::map<std::string, std::vector<double>>;

Table ReadTable(const std::string& name, const EnvSpec& spec) {
  std::vector<std::string> columns{"torque", "reward", "terminated"};
  for (const std::string& variable : spec.state_names) {
    columns.push_back(variable);
    columns.push_back(Concat("next_", variable));
  }
  for (int j = 0; j < spec.obs_size; ++j) columns.push_back(Concat("obs", j));
  const auto path = std::filesystem::path(__FILE__).parent_path() / "testdata" / name;
  std::ifstream file(path);
  if (!file) throw Failure(Concat("cannot read ", path.string()));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  Table table;
  for (CsvColumn& column : ReadCsv(text, columns, path.string())) {
    table[column.name] = std::move(column.values);
  }
  return table;
}

/// Expects every row of the file from one step of one environment per row. Tolerance: a step makes
/// some hundred roundings of 1e-16 of numbers up to 1e3, weighted by its 0.2 s. NumPy's sines
/// differ from the C library's in the last digit. Gymnasium's theta of Pendulum-v1 grows to 60 rad,
/// with a last digit of 7e-15. The largest difference so far is 2e-14, so 1e-12 is ample.
/// Observations are floats; such a difference can round them to the neighbour, 1.2e-7 of their
/// size.
template <typename Task>
void ExpectStepsOf(const Table& table) {
  GymTaskConfig config;
  config.num_envs = static_cast<int>(table.at("torque").size());
  Task env(config);
  const EnvSpec& spec = env.spec();
  const size_t S = spec.state_names.size(), D = static_cast<size_t>(spec.obs_size);
  const auto is_angle = [&](size_t k) { return spec.state_units[k] == "rad"; };

  std::vector<double> state(S);
  for (int i = 0; i < config.num_envs; ++i) {
    for (size_t k = 0; k < S; ++k) {
      state[k] = table.at(spec.state_names[k])[static_cast<size_t>(i)];
      if (is_angle(k)) state[k] = std::remainder(state[k], 2 * kPi);
    }
    env.SetState(i, state);
  }
  StepResult result(spec);
  env.Step({table.at("torque").data(), config.num_envs, 1}, result);

  for (int env_index = 0; env_index < config.num_envs; ++env_index) {
    const auto i = static_cast<size_t>(env_index);
    ASSERT_NEAR(result.reward[i], table.at("reward")[i], 1e-12) << i;
    ASSERT_EQ(result.terminated[i], table.at("terminated")[i]) << i;
    for (size_t j = 0; j < D; ++j) {
      const double expected = table.at(Concat("obs", j))[i];
      const double tolerance = 1.2e-7 * std::max(1.0, std::abs(expected));
      ASSERT_NEAR(result.next_obs[i * D + j], expected, tolerance) << i << ", " << j;
    }
    if (result.done(i)) continue;  // an ended episode already has a new state
    env.GetState(env_index, state);
    for (size_t k = 0; k < S; ++k) {
      double difference = state[k] - table.at(Concat("next_", spec.state_names[k]))[i];
      if (is_angle(k)) difference = std::remainder(difference, 2 * kPi);
      ASSERT_NEAR(difference, 0, 1e-12) << i << ", " << spec.state_names[k];
    }
  }
}

/// Number of values within 1e-12 of ± bound.
int64_t CountAt(double bound, const std::vector<double>& values) {
  return std::ranges::count_if(values,
                               [&](double x) { return std::abs(std::abs(x) - bound) < 1e-12; });
}

TEST(Gymnasium, PendulumV1StepsAsTheirs) {
  const Table table = ReadTable("gymnasium_pendulum_v1.csv", PendulumV1({}).spec());
  ExpectStepsOf<PendulumV1>(table);
  // The 600 steps include some at the velocity bound and some beyond a full turn.
  EXPECT_EQ(table.at("torque").size(), 600);
  EXPECT_GT(CountAt(8, table.at("next_omega")), 10);
  EXPECT_GT(std::ranges::max(table.at("next_theta")), 4 * kPi);
}

TEST(Gymnasium, AcrobotV1StepsAsTheirs) {
  const Table table = ReadTable("gymnasium_acrobot_v1.csv", AcrobotV1({}).spec());
  ExpectStepsOf<AcrobotV1>(table);
  // The 800 steps include some at each velocity bound, some that wrap, and some at the goal.
  EXPECT_EQ(table.at("torque").size(), 800);
  EXPECT_GT(CountAt(4 * kPi, table.at("next_omega1")), 5);
  EXPECT_GT(CountAt(9 * kPi, table.at("next_omega2")), 5);
  EXPECT_GT(CountAt(1, table.at("terminated")), 50);
  for (const std::string name : {"theta1", "theta2"}) {
    int wraps = 0;
    for (size_t i = 0; i < 800; ++i) {
      wraps += std::abs(table.at("next_" + name)[i] - table.at(name)[i]) > 5 ? 1 : 0;
    }
    EXPECT_GT(wraps, 10) << name;
  }
}

}  // namespace
}  // namespace upswing
