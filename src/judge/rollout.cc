#include "judge/rollout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "agents/config.h"
#include "base/csv.h"
#include "base/error.h"
#include "base/text.h"
#include "judge/trial.h"
#include "pendulum/control_period.h"
#include "rl/train/evaluate.h"

namespace upswing {
namespace {

/// The policy's values (Q) in units of reward.
std::vector<double> ValuesOf(const Policy& policy, Matrix<const float> obs,
                             Policy::Memory& memory) {
  std::vector<float> numbers(static_cast<size_t>(policy.num_values()));
  policy.Values(obs, Matrix<float>(numbers.data(), 1, policy.num_values()), memory);
  const double scale = policy.info().reward_scale.value_or(1);
  std::vector<double> values;
  values.reserve(numbers.size());
  for (const float value : numbers) values.push_back(value / scale);
  return values;
}

/// The time (s) of a control step. Of whole steps a second it is rounded once.
double TimeOf(size_t step, double period) {
  const double steps = std::round(1 / period);
  if (1 / period == steps) return static_cast<double>(step) / steps;
  return static_cast<double>(step) * period;
}

/// Adds the estimates that the policy has to a row.
void AddEstimates(const Policy& policy, Matrix<const float> obs, Policy::Memory& memory,
                  RolloutRow& row) {
  if (policy.num_values() > 0) row.q = ValuesOf(policy, obs, memory);
  if (!policy.has_spread()) return;
  row.spread.emplace();
  policy.Spread(obs, {&row.spread->low, 1, 1}, {&row.spread->high, 1, 1}, memory);
}

}  // namespace

Episode::Episode(RolloutConfig config)
    : config_(std::move(config)),
      env_([&] {
        PendulumEnvConfig env = config_.env;
        env.episode_seconds = config_.seconds + 1;
        return std::make_unique<PendulumEnv>(env);
      }()),
      result_(env_->spec()),
      rollout_{.rows = {}, .plant = Plant(), .disturbance = Disturbance()} {
  if (config_.start) env_->SetState(0, *config_.start);
  if (config_.policy != nullptr) memory_ = config_.policy->Start(1);
  rollout_.control_period = period();
  rollout_.return_seconds = env_->spec().evaluation.return_seconds;
  rollout_.plant = env_->plant(0);
  rollout_.disturbance = env_->disturbance(0);
  rollout_.goal = env_->goal(0);
}

void Episode::Step(const std::array<double, 2>& push) {
  if (push != push_) env_->Push(0, push);
  push_ = push;
  const size_t step = rollout_.rows.size();
  double torque = 0;
  if (config_.policy != nullptr) config_.policy->Act(env_->obs(), {&torque, 1, 1}, *memory_);
  if (step < config_.schedule.size()) torque = config_.schedule[step];
  RolloutRow row;
  row.t = TimeOf(step, period());
  row.state = env_->state(0);
  row.inverted = Inverted(SeenFrom(rollout_.goal.value_or(Pose()), row.state));
  row.chosen = torque;
  if (config_.estimates) AddEstimates(*config_.policy, env_->obs(), *memory_, row);
  env_->Step({&torque, 1}, result_);
  row.torque = result_.torque[0];
  row.reward = result_.reward[0];
  std::copy_n(result_.reward_terms.begin(), kRewardTerms, row.terms.begin());
  rollout_.rows.push_back(std::move(row));
  if (result_.terminated[0] == 0) return;
  throw Failure(
      Concat("the simulation diverged after t = ", FormatNumber(rollout_.rows.back().t), " s"));
}

PendulumState Episode::StateOfRow(int64_t k) const {
  return k < steps() ? rollout_.rows[static_cast<size_t>(k)].state : env_->state(0);
}

PendulumState Episode::StateAt(double steps) const {
  const auto k = static_cast<int64_t>(std::floor(steps));
  const double share = steps - static_cast<double>(k);
  const PendulumState a = StateOfRow(k);
  return share > 0 ? StateBetween(a, StateOfRow(k + 1), period(), share) : a;
}

double Episode::TorqueAt(double steps) const {
  const auto k = std::min(static_cast<int64_t>(std::floor(steps)), this->steps() - 1);
  return k < 0 ? 0 : rollout_.rows[static_cast<size_t>(k)].torque;
}

Rollout RunRollout(const RolloutConfig& config) {
  Episode episode(config);
  // Step once more than the rollout has steps: the extra step computes the motor's torque in the
  // last state.
  const int64_t steps = PeriodsIn(config.seconds, config.env.control_period);
  while (episode.steps() <= steps && !episode.done()) episode.Step();
  Rollout rollout = episode.rollout();
  rollout.rows.back().reward = 0;
  rollout.rows.back().terms = {};
  return rollout;
}

std::string TorqueText(const Rollout& rollout) {
  const std::vector<RolloutRow>& rows = rollout.rows;
  // Leave out the last state, because no step follows it.
  const size_t steps = std::max<size_t>(1, rows.size() - 1);
  TorqueTally tally({&rollout.plant.torque_limit, 1}, rollout.control_period);
  for (size_t k = 0; k < steps; ++k) {
    const size_t after = std::min(k + 1, rows.size() - 1);
    tally.Add({&rows[k].torque, 1}, rows[after].inverted);
  }
  EvaluationEpisode e;
  tally.Finish(tally.has_goal_steps(), e);
  std::string text = fmt::format("peak {:.4g} N·m, rms {:.4g} N·m, variation {:.4g} N·m/s",
                                 e.peak_torque, e.rms_torque, e.torque_variation);
  if (!tally.has_goal_steps()) return text;
  return text +
         fmt::format(", once {} {:.4g} N·m/s", Reached(rollout.goal.has_value()), e.goal_variation);
}

std::string RewardText(const Rollout& rollout) {
  const auto& rows = rollout.rows;
  const auto sum = [&](size_t steps) {
    double reward = 0;
    for (size_t k = 0; k < steps; ++k) reward += rows[k].reward;
    return reward;
  };
  const size_t steps = rows.size() - 1;
  const auto counted =
      static_cast<size_t>(PeriodsIn(rollout.return_seconds, rollout.control_period));
  std::string text = fmt::format("{:.6g} in {:g} s", sum(steps), rows.back().t);
  if (steps <= counted) return text;
  return text + fmt::format(", {:.6g} in the first {:g} s", sum(counted), rollout.return_seconds);
}

std::string RolloutCsv(const Rollout& rollout) {
  constexpr const char* kTerms[] = {"energy_reward", "height_reward", "balance_reward",
                                    "velocity_penalty", "torque_penalty"};
  CsvTable csv;
  for (const RolloutRow& row : rollout.rows) {
    const PendulumState& s = row.state;
    csv.Add("t", row.t);
    csv.Add("q1", s.q1);
    csv.Add("q2", s.q2);
    csv.Add("w1", s.w1);
    csv.Add("w2", s.w2);
    csv.Add("torque", row.torque);
    csv.Add("energy", Energy(rollout.plant, s));
    csv.Add("height", TipHeight(rollout.plant, s));
    csv.Add("inverted", row.inverted ? 1 : 0);
    csv.Add("reward", row.reward);
    for (size_t k = 0; k < kRewardTerms; ++k) csv.Add(kTerms[k], row.terms[k] + 0.0);  // no -0
    const bool at_first = rollout.plant.actuated_joint == 1;
    csv.Add("torque1", at_first ? row.torque : 0);
    csv.Add("torque2", at_first ? 0 : row.torque);
    csv.EndRow();
  }
  return csv.text();
}

std::string JudgementText(const Policy& policy, const PendulumEnvConfig& config) {
  PendulumEnv env(config);
  const EvaluationEpisode episode = EvaluateEpisodes(policy, env).front();
  const std::string upright = episode.swing_up_seconds
                                  ? fmt::format("{} from {:.2f} s to the end",
                                                Reached(config.any_pose), *episode.swing_up_seconds)
                                  : Concat("not ", Reached(config.any_pose), " at the end");
  return fmt::format("{}, {}, return {:.6g}", episode.success ? "success" : "failure", upright,
                     episode.reward_sum);
}

std::string EpisodeText(const Rollout& rollout) {
  std::string text = PlantText(rollout.plant);
  if (rollout.goal) text += Concat(", goal ", PoseName(*rollout.goal));
  const Options options = OptionsOf(rollout.disturbance);
  for (const Option& option : options.all()) {
    if (option.number() > 0) text += Concat(", ", option.name, " ", FormatNumber(option.number()));
  }
  return text;
}

}  // namespace upswing
