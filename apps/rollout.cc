#include "apps/rollout.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

constexpr double kStepsPerSecond = 50;  // 1 / kControlPeriod, exactly
static_assert(kStepsPerSecond * kControlPeriod == 1);

RolloutRow RowOf(double t, const PendulumState& s, double torque, const Plant& plant) {
  RolloutRow row;
  row.t = t;
  row.state = s;
  row.torque = torque;
  row.energy = Energy(plant, s);
  row.height = TipHeight(plant, s);
  row.inverted = Inverted(s);
  row.terms = RewardTerms(plant, s, torque);
  for (const double term : row.terms) row.reward += term;
  return row;
}

std::vector<float> QValuesOf(const Policy& policy, Matrix<const float> obs) {
  const int actions = policy.shape().actions;
  std::vector<float> q(static_cast<size_t>(actions));
  policy.QValues(obs, Matrix<float>(q.data(), 1, actions));
  return q;
}

}  // namespace

int64_t RolloutSteps(double seconds) { return std::llround(seconds * kStepsPerSecond); }

std::vector<RolloutRow> RunRollout(const RolloutConfig& config) {
  PendulumEnvConfig env_config;
  env_config.physics = config.physics;
  env_config.mjcf = config.mjcf;
  if (config.policy != nullptr) {
    env_config.memory = MemorySteps(config.policy->shape().inputs);
  }
  env_config.plants = {config.plant};
  env_config.episode_seconds = config.seconds + 1;
  PendulumEnv env(env_config);
  env.SetState(0, config.start);

  std::vector<RolloutRow> rows;
  const int64_t steps = RolloutSteps(config.seconds);
  StepResult result = env.MakeResult();
  for (int64_t k = 0; k <= steps; ++k) {
    // Behind the end of a schedule there is one more state, which no torque follows.
    double torque = 0;
    if (config.policy != nullptr) config.policy->Act(env.obs(), std::span(&torque, 1));
    const auto step = static_cast<size_t>(k);
    if (step < config.schedule.size()) torque = config.schedule[step];
    // The motor gives what it can; what an observation remembers is what was chosen.
    const double limit = config.plant.torque_limit;
    const double applied = std::clamp(torque, -limit, limit);
    const double t = static_cast<double>(k) / kStepsPerSecond;
    rows.push_back(RowOf(t, env.state(0), applied, config.plant));
    if (config.q_values) rows.back().q = QValuesOf(*config.policy, env.obs());
    if (k == steps) break;
    env.Step(std::span(&torque, 1), result);
    if (result.terminated[0]) {
      throw Failure(Concat("the state blew up numerically after t = ", FormatNumber(t), " s"));
    }
  }
  return rows;
}

PendulumState ParseStart(const std::string& text) {
  const std::vector<std::string_view> pieces = Split(text, ',');
  std::vector<double> numbers;
  for (const std::string_view piece : pieces) {
    const auto number = ParseNumber(piece);
    if (number && std::isfinite(*number)) numbers.push_back(*number);
  }
  if (pieces.size() != 4 || numbers.size() != 4) {
    throw BadInput(Concat("--start: expected four numbers q1,q2,w1,w2, got \"", text, "\""));
  }
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

}  // namespace upswing
