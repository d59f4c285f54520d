#include "lab/rollout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "lab/config.h"

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

/// (Q) in units of reward.
std::vector<double> ValuesOf(const Policy& policy, Matrix<const float> obs,
                             Policy::Memory& memory) {
  std::vector<float> numbers(static_cast<size_t>(policy.num_values()));
  policy.Values(obs, Matrix<float>(numbers.data(), 1, policy.num_values()), memory);
  const double scale = ValueUnitsOf(policy).reward_scale;
  std::vector<double> values;
  for (const float value : numbers) values.push_back(value / scale);
  return values;
}

}  // namespace

int64_t RolloutSteps(double seconds) { return std::llround(seconds * kStepsPerSecond); }

Rollout RunRollout(const RolloutConfig& config) {
  PendulumEnvConfig env_config = config.env;
  env_config.episode_seconds = config.seconds + 1;
  PendulumEnv env(env_config);
  if (config.start) env.SetState(0, *config.start);

  Rollout rollout{{}, env.plant(0), env.disturbance(0)};
  const int64_t steps = RolloutSteps(config.seconds);
  StepResult result = env.MakeResult();
  std::unique_ptr<Policy::Memory> memory;
  if (config.policy != nullptr) memory = config.policy->Start(1);
  for (int64_t k = 0; k <= steps; ++k) {
    // Behind the end of a schedule there is one more state, which no torque follows.
    double torque = 0;
    if (config.policy != nullptr) config.policy->Act(env.obs(), {&torque, 1, 1}, *memory);
    const auto step = static_cast<size_t>(k);
    if (step < config.schedule.size()) torque = config.schedule[step];
    const double t = static_cast<double>(k) / kStepsPerSecond;
    const PendulumState state = env.state(0);
    std::vector<double> q;
    if (config.q_values) q = ValuesOf(*config.policy, env.obs(), *memory);
    // One step more than there are rows: it gives the motor's torque in the last state.
    env.Step(std::span(&torque, 1), result);
    if (result.terminated[0] && k < steps) {
      throw Failure(Concat("the state blew up numerically after t = ", FormatNumber(t), " s"));
    }
    rollout.rows.push_back(RowOf(t, state, result.torque[0], rollout.plant));
    rollout.rows.back().q = std::move(q);
  }
  return rollout;
}

EvaluationEpisode JudgeEpisode(const Policy& policy, const PendulumEnvConfig& config) {
  PendulumEnv env(config);
  return EvaluateEpisodes(policy, env).front();
}

std::string JudgementText(const EvaluationEpisode& episode) {
  const std::string upright =
      episode.swing_up_seconds < kEvaluationSeconds
          ? fmt::format("upright from {:.2f} s to the end", episode.swing_up_seconds)
          : "not upright at the end";
  return fmt::format("{}, {}, return {:.6g}", episode.success ? "success" : "failure", upright,
                     episode.reward_sum);
}

std::string EpisodeText(const Rollout& rollout) {
  std::string text = PlantText(rollout.plant);
  const auto& [noise, delay] = rollout.disturbance;
  if (noise > 0) text += Concat(", sensor_noise ", FormatNumber(noise));
  if (delay > 0) text += Concat(", delay ", FormatNumber(delay));
  return text;
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
