#include "rl/evaluate.h"

#include <algorithm>
#include <cmath>

namespace upswing {
namespace {

int64_t StepsIn(double seconds, const VectorEnv& env) {
  return std::llround(seconds / env.step_seconds());
}

/// Accumulates the results of one episode, step by step.
class EpisodeTally {
 public:
  EpisodeTally(const Policy& policy, const VectorEnv& env)
      : seconds_(env.step_seconds()),
        steps_(StepsIn(kEvaluationSeconds, env)),
        return_steps_(StepsIn(kReturnSeconds, env)),
        hold_steps_(StepsIn(kHoldSeconds, env)),
        tilt_steps_(StepsIn(kSteadyTiltSeconds, env)),
        gamma_(ValueUnitsOf(policy).gamma),
        discount_(gamma_ > 0 ? 1 : 0),
        lean_(static_cast<size_t>(env.bodies())) {
    episode_.terms.resize(env.reward_term_names().size());
    episode_.tilt.resize(lean_.size());
  }

  void SetValue(double value) { episode_.value = value; }

  /// Adds the lean of environment `env_index` before its next step.
  void SeeLean(const VectorEnv& env, int env_index) {
    if (ended_ || lean_.empty()) return;
    env.Lean(env_index, lean_);
    const bool settled =
        std::ranges::all_of(lean_, [](double x) { return std::abs(x) < kSettledTilt; });
    if (!settled) settled_since_ = -1;
    if (settled && settled_since_ < 0) settled_since_ = step_;
    if (step_ < steps_ - tilt_steps_) return;
    for (size_t b = 0; b < lean_.size(); ++b) {
      episode_.tilt[b] += lean_[b] / static_cast<double>(tilt_steps_);
    }
  }

  /// Adds environment `i` of the next step's result.
  void Add(const StepResult& result, size_t i) {
    if (ended_) return;
    ++step_;
    const double torque = result.torque[i];
    episode_.work += result.work[i];
    episode_.peak_torque = std::max(episode_.peak_torque, std::abs(torque));
    squares_ += torque * torque;
    AddChange(step_ == 1 ? 0 : std::abs(torque - last_torque_));
    last_torque_ = torque;
    episode_.discounted_return += discount_ * result.reward[i];
    discount_ *= gamma_;
    const size_t terms = episode_.terms.size();
    if (step_ <= return_steps_) {
      episode_.reward_sum += result.reward[i];
      for (size_t j = 0; j < terms; ++j) episode_.terms[j] += result.reward_terms[i * terms + j];
    }
    if (!result.at_goal[i]) goal_since_ = -1;
    if (result.at_goal[i] && goal_since_ < 0) {
      goal_since_ = step_;
      goal_variation_ = goal_changes_ = 0;
    }
    ended_ = result.terminated[i];
  }

  /// The results; call once, at the end.
  EvaluationEpisode Finish() {
    const bool at_goal = goal_since_ >= 0 && !ended_;
    const bool settled = settled_since_ >= 0 && at_goal;
    const auto seconds = [&](int64_t steps) { return static_cast<double>(steps) * seconds_; };
    EvaluationEpisode& e = episode_;
    e.swing_up_seconds = at_goal ? seconds(goal_since_) : kEvaluationSeconds;
    e.settling_seconds = settled ? seconds(settled_since_) : kEvaluationSeconds;
    e.success = at_goal && goal_since_ <= steps_ - hold_steps_;
    e.rms_torque = std::sqrt(squares_ / static_cast<double>(steps_));
    e.torque_variation = variation_ / kEvaluationSeconds;
    if (at_goal && goal_since_ < steps_) {
      e.goal_variation = goal_variation_ / seconds(steps_ - goal_since_);
      e.goal_changes = static_cast<double>(goal_changes_) / seconds(steps_ - goal_since_);
    }
    return std::move(e);
  }

 private:
  /// |change| of the torque from the last step to this one, N·m.
  void AddChange(double change) {
    variation_ += change;
    goal_variation_ += change;
    goal_changes_ += change > 0 ? 1 : 0;
  }

  double seconds_;  // of a step
  int64_t steps_, return_steps_, hold_steps_, tilt_steps_;
  double gamma_, discount_;   // γ, γᵏ
  std::vector<double> lean_;  // (bodies) rad, now
  int64_t step_ = 0;          // steps so far
  int64_t goal_since_ = -1;   // first state of the present stretch at the goal
  int64_t settled_since_ = -1;
  bool ended_ = false;  // by a numerical blow-up: further steps belong to another episode
  double last_torque_ = 0, squares_ = 0, variation_ = 0;
  double goal_variation_ = 0;  // in the present stretch at the goal
  int64_t goal_changes_ = 0;
  EvaluationEpisode episode_;
};

/// Sets the policy's value of each environment's present state, if its units are known.
void EstimateValues(const Policy& policy, const VectorEnv& env, std::span<EpisodeTally> tallies) {
  const ValueUnits units = ValueUnitsOf(policy);
  if (units.gamma == 0) return;
  // A workspace of its own: evaluations in other threads may share the policy.
  Policy::Workspace workspace = policy.MakeWorkspace();
  AlignedVector<float> values(tallies.size() * policy.torques().size());
  const Matrix<float> q(values, env.num_envs(), static_cast<int>(policy.torques().size()));
  policy.QValues(env.obs(), q, workspace);
  for (int i = 0; i < env.num_envs(); ++i) {
    tallies[static_cast<size_t>(i)].SetValue(std::ranges::max(q.row(i)) / units.reward_scale);
  }
}

/// One figure of each episode.
std::vector<double> Figures(const std::vector<const EvaluationEpisode*>& episodes,
                            double EvaluationEpisode::*figure) {
  std::vector<double> values;
  for (const EvaluationEpisode* episode : episodes) values.push_back(episode->*figure);
  return values;
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

ValueUnits ValueUnitsOf(const Policy& policy) {
  const PolicyInfo& info = policy.info();
  if (!info.gamma || !info.reward_scale) return {};
  return {*info.gamma, *info.reward_scale};
}

Evaluation Summarize(std::span<const EvaluationEpisode> episodes) {
  std::vector<const EvaluationEpisode*> all, successful, settled;
  Evaluation e;
  for (const EvaluationEpisode& episode : episodes) {
    all.push_back(&episode);
    if (!episode.success) continue;
    successful.push_back(&episode);
    if (episode.settling_seconds < kEvaluationSeconds) settled.push_back(&episode);
  }
  e.episodes = static_cast<int64_t>(all.size());
  e.successes = static_cast<int64_t>(successful.size());
  e.success_interval = WilsonInterval(e.successes, e.episodes);
  e.swing_up_seconds = QuartilesOf(Figures(successful, &EvaluationEpisode::swing_up_seconds));
  e.settled = static_cast<int64_t>(settled.size());
  e.settling_seconds = QuartilesOf(Figures(settled, &EvaluationEpisode::settling_seconds));
  e.reward_sum = MomentsOf(Figures(all, &EvaluationEpisode::reward_sum));
  e.work = MomentsOf(Figures(all, &EvaluationEpisode::work));
  e.rms_torque = MomentsOf(Figures(all, &EvaluationEpisode::rms_torque));
  e.torque_variation = MomentsOf(Figures(all, &EvaluationEpisode::torque_variation));
  e.goal_variation = MomentsOf(Figures(successful, &EvaluationEpisode::goal_variation));
  e.goal_changes = MomentsOf(Figures(successful, &EvaluationEpisode::goal_changes));
  for (size_t body = 0; !successful.empty() && body < episodes.front().tilt.size(); ++body) {
    std::vector<double> tilts;
    for (const auto* episode : successful) tilts.push_back(std::abs(episode->tilt[body]));
    e.tilt.push_back(MomentsOf(tilts));
  }
  if (!episodes.empty()) e.term_means.resize(episodes.front().terms.size());
  const double share = 1 / static_cast<double>(std::max<size_t>(1, episodes.size()));
  for (const EvaluationEpisode& episode : episodes) {
    e.peak_torque = std::max(e.peak_torque, episode.peak_torque);
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
  const int n = env.num_envs();
  SharedActing act(policy, n, pool);
  StepResult result = env.MakeResult();
  std::vector<double> torque(static_cast<size_t>(n));
  std::vector<EpisodeTally> tallies(static_cast<size_t>(n), EpisodeTally(policy, env));
  EstimateValues(policy, env, tallies);

  const int64_t steps = StepsIn(kEvaluationSeconds, env);
  for (int64_t k = 1; k <= steps; ++k) {
    // Before the step: after the last one an environment that timed out has been reset.
    for (int i = 0; i < n; ++i) tallies[static_cast<size_t>(i)].SeeLean(env, i);
    act(env.obs(), torque);
    env.Step(torque, result);
    for (int i = 0; i < n; ++i) tallies[static_cast<size_t>(i)].Add(result, static_cast<size_t>(i));
    if (progress) progress(static_cast<double>(k) / static_cast<double>(steps));
  }

  std::vector<EvaluationEpisode> episodes;
  for (EpisodeTally& tally : tallies) episodes.push_back(tally.Finish());
  return episodes;
}

Evaluation Evaluate(const Policy& policy, VectorEnv& env, ThreadPool* pool,
                    const std::function<void(double)>& progress) {
  return Summarize(EvaluateEpisodes(policy, env, pool, progress));
}

}  // namespace upswing
