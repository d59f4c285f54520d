#include "rl/evaluate.h"

#include <algorithm>
#include <cmath>

namespace upswing {
namespace {

int64_t StepsIn(double seconds, const VectorEnv& env) {
  return std::llround(seconds / env.step_seconds());
}

/// What Q-values estimate, as a policy's file says: the sum of γᵏ · scale · r. γ = 0 if it does not
/// say.
struct ValueUnits {
  double gamma = 0, reward_scale = 1;
};

ValueUnits ValueUnitsOf(const Policy& policy) {
  const PolicyInfo& info = policy.info();
  if (!info.gamma || !info.reward_scale) return {};
  return {*info.gamma, *info.reward_scale};
}

/// What the policy expects of where the environments stand.
void EstimateValues(const Policy& policy, const VectorEnv& env, const ValueUnits& units,
                    std::span<EvaluationEpisode> episodes) {
  // A workspace of its own: evaluations in other threads may share the policy.
  Policy::Workspace workspace = policy.MakeWorkspace();
  AlignedVector<float> values(episodes.size() * policy.torques().size());
  const Matrix<float> q(values, env.num_envs(), static_cast<int>(policy.torques().size()));
  policy.QValues(env.obs(), q, workspace);
  for (int i = 0; i < env.num_envs(); ++i) {
    episodes[static_cast<size_t>(i)].value = std::ranges::max(q.row(i)) / units.reward_scale;
  }
}

/// Acts for all environments, in slices that a pool can share.
class SharedActing {
 public:
  SharedActing(const Policy& policy, int num_envs, ThreadPool* pool)
      : policy_(policy), pool_(pool) {
    // Enough slices to level out threads of unequal speed; fewer rows are not worth another thread.
    constexpr int kSmallestSlice = 16;
    const int most = pool == nullptr ? 1 : 2 * pool->threads();
    const int slices = std::clamp(num_envs / kSmallestSlice, 1, most);
    size_ = (num_envs + slices - 1) / slices;
    for (int first = 0; first < num_envs; first += size_) {
      workspaces_.push_back(policy.MakeWorkspace());
    }
  }

  void operator()(Matrix<const float> obs, std::span<double> torque) {
    ParallelFor(pool_, static_cast<int>(workspaces_.size()), [&](int slice) {
      const int first = slice * size_;
      const int count = std::min(size_, obs.rows() - first);
      policy_.Act(obs.Rows(first, count),
                  torque.subspan(static_cast<size_t>(first), static_cast<size_t>(count)),
                  workspaces_[static_cast<size_t>(slice)]);
    });
  }

 private:
  const Policy& policy_;
  ThreadPool* pool_;
  int size_;                                   // rows in a slice
  std::vector<Policy::Workspace> workspaces_;  // one for each slice
};

}  // namespace

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
  if (!episodes.empty()) e.term_means.resize(episodes.front().terms.size());
  const double share = 1 / static_cast<double>(std::max<size_t>(1, episodes.size()));
  for (const EvaluationEpisode& episode : episodes) {
    e.value += share * episode.value;
    e.discounted_return += share * episode.discounted_return;
    for (size_t j = 0; j < e.term_means.size(); ++j) {
      e.term_means[j] += share * episode.terms[j];
    }
  }
  return e;
}

std::vector<EvaluationEpisode> EvaluateEpisodes(const Policy& policy, VectorEnv& env,
                                                ThreadPool* pool,
                                                const std::function<void(double)>& progress) {
  const auto n = static_cast<size_t>(env.num_envs());
  const int64_t steps = StepsIn(kEvaluationSeconds, env);
  const int64_t return_steps = StepsIn(kReturnSeconds, env);
  const size_t terms = env.reward_term_names().size();
  SharedActing act(policy, env.num_envs(), pool);
  StepResult result = env.MakeResult();
  std::vector<double> torque(n);
  std::vector<EvaluationEpisode> episodes(n);
  for (EvaluationEpisode& episode : episodes) episode.terms.resize(terms);
  const ValueUnits units = ValueUnitsOf(policy);
  if (units.gamma > 0) EstimateValues(policy, env, units, episodes);
  double discount = units.gamma > 0 ? 1 : 0;  // γᵏ
  std::vector<int64_t> goal_since(n, -1);     // first state of the present stretch at the goal
  std::vector<uint8_t> ended(n);              // blown up: what follows is another episode

  for (int64_t k = 1; k <= steps; ++k) {
    act(env.obs(), torque);
    env.Step(torque, result);
    for (size_t i = 0; i < n; ++i) {
      if (ended[i]) continue;
      EvaluationEpisode& episode = episodes[i];
      episode.work += result.work[i];
      episode.peak_torque = std::max(episode.peak_torque, std::abs(result.torque[i]));
      episode.rms_torque += result.torque[i] * result.torque[i];
      episode.discounted_return += discount * result.reward[i];
      if (k <= return_steps) {
        episode.reward_sum += result.reward[i];
        for (size_t j = 0; j < terms; ++j) episode.terms[j] += result.reward_terms[i * terms + j];
      }
      if (!result.at_goal[i]) goal_since[i] = -1;
      if (result.at_goal[i] && goal_since[i] < 0) goal_since[i] = k;
      ended[i] = result.terminated[i];
    }
    discount *= units.gamma;
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
  return episodes;
}

Evaluation Evaluate(const Policy& policy, VectorEnv& env, ThreadPool* pool,
                    const std::function<void(double)>& progress) {
  return Summarize(EvaluateEpisodes(policy, env, pool, progress));
}

}  // namespace upswing
