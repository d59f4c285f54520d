#include "rl/evaluate.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace upswing {
namespace {

int64_t StepsIn(double seconds, const VectorEnv& env) {
  return std::llround(seconds / env.step_seconds());
}

Evaluation Summarize(std::span<const EvaluationEpisode> episodes) {
  Evaluation e;
  e.episodes = static_cast<int64_t>(episodes.size());
  std::vector<double> swing_up, reward_sum, work, rms;
  for (const EvaluationEpisode& episode : episodes) {
    if (episode.success) swing_up.push_back(episode.swing_up_seconds);
    reward_sum.push_back(episode.reward_sum);
    work.push_back(episode.work);
    rms.push_back(episode.rms_torque);
    e.peak_torque = std::max(e.peak_torque, episode.peak_torque);
  }
  e.successes = static_cast<int64_t>(swing_up.size());
  e.success_interval = WilsonInterval(e.successes, e.episodes);
  e.swing_up_seconds = QuartilesOf(std::move(swing_up));
  e.reward_sum = MomentsOf(reward_sum);
  e.work = MomentsOf(work);
  e.rms_torque = MomentsOf(rms);
  return e;
}

}  // namespace

Evaluation Evaluate(const Policy& policy, VectorEnv& env,
                    const std::function<void(double)>& progress) {
  const auto n = static_cast<size_t>(env.num_envs());
  const int64_t steps = StepsIn(kEvaluationSeconds, env);
  const int64_t return_steps = StepsIn(kReturnSeconds, env);
  const size_t terms = env.reward_term_names().size();
  StepResult result = env.MakeResult();
  std::vector<double> torque(n);
  std::vector<EvaluationEpisode> episodes(n);
  std::vector<int64_t> goal_since(n, -1);  // first state of the present stretch at the goal
  std::vector<uint8_t> ended(n);           // blown up: what follows is another episode
  std::vector<double> term_means(terms);

  for (int64_t k = 1; k <= steps; ++k) {
    policy.Act(env.obs(), torque);
    env.Step(torque, result);
    for (size_t i = 0; i < n; ++i) {
      if (ended[i]) continue;
      EvaluationEpisode& episode = episodes[i];
      episode.work += result.work[i];
      episode.peak_torque = std::max(episode.peak_torque, std::abs(result.torque[i]));
      episode.rms_torque += result.torque[i] * result.torque[i];
      if (k <= return_steps) {
        episode.reward_sum += result.reward[i];
        for (size_t j = 0; j < terms; ++j) {
          term_means[j] += result.reward_terms[i * terms + j] / static_cast<double>(n);
        }
      }
      if (!result.at_goal[i]) goal_since[i] = -1;
      if (result.at_goal[i] && goal_since[i] < 0) goal_since[i] = k;
      ended[i] = result.terminated[i];
    }
    if (progress) progress(static_cast<double>(k) / static_cast<double>(steps));
  }

  for (size_t i = 0; i < n; ++i) {
    const bool at_goal = goal_since[i] >= 0 && !ended[i];
    EvaluationEpisode& episode = episodes[i];
    episode.swing_up_seconds =
        at_goal ? static_cast<double>(goal_since[i]) * env.step_seconds() : kEvaluationSeconds;
    episode.success = at_goal && goal_since[i] <= steps - StepsIn(kHoldSeconds, env);
    episode.rms_torque = std::sqrt(episode.rms_torque / static_cast<double>(steps));
  }
  Evaluation evaluation = Summarize(episodes);
  evaluation.term_means = std::move(term_means);
  return evaluation;
}

}  // namespace upswing
