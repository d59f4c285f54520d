#include "rl/evaluate.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "core/aligned.h"
#include "core/thread_tuner.h"

namespace upswing {
namespace {

int64_t StepsIn(double seconds, const EnvSpec& spec) {
  return std::llround(seconds / spec.step_seconds);
}

/// Accumulates the results of one episode, step by step.
class EpisodeTally {
 public:
  EpisodeTally(const Policy& policy, const EnvSpec& spec)
      : rule_(spec.evaluation),
        seconds_(spec.step_seconds),
        steps_(StepsIn(rule_.seconds, spec)),
        return_steps_(StepsIn(rule_.return_seconds, spec)),
        hold_steps_(StepsIn(rule_.hold_seconds, spec)),
        tilt_steps_(StepsIn(kSteadyTiltSeconds, spec)),
        gamma_(ValueUnitsOf(policy).gamma),
        discount_(gamma_ > 0 ? 1 : 0),
        lean_(static_cast<size_t>(spec.bodies)),
        last_torque_(spec.action_limit.size()) {
    episode_.terms.resize(spec.term_names.size());
    episode_.tilt.resize(lean_.size());
  }

  bool ended() const { return ended_; }
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
    episode_.work += result.work[i];
    const size_t A = last_torque_.size();
    AddTorque(std::span(result.torque).subspan(i * A, A));
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
    // Where the goal ends an episode, it is reached; else an end is a numerical blow-up.
    const bool at_goal = goal_since_ >= 0 && (!ended_ || rule_.by_return());
    const bool settled = settled_since_ >= 0 && at_goal;
    const auto seconds = [&](int64_t steps) { return static_cast<double>(steps) * seconds_; };
    EvaluationEpisode& e = episode_;
    e.seconds = seconds(step_);
    if (at_goal) e.swing_up_seconds = seconds(goal_since_);
    if (settled) e.settling_seconds = seconds(settled_since_);
    e.success = rule_.by_return() ? e.reward_sum >= rule_.solved_return
                                  : at_goal && goal_since_ <= steps_ - hold_steps_;
    e.rms_torque = std::sqrt(squares_ / static_cast<double>(step_));
    e.torque_variation = variation_ / seconds(step_);
    if (at_goal && goal_since_ < step_) {
      e.goal_variation = goal_variation_ / seconds(step_ - goal_since_);
      e.goal_changes = static_cast<double>(goal_changes_) / seconds(step_ - goal_since_);
    }
    return std::move(e);
  }

 private:
  /// Adds the torques (A) of a step, N·m.
  void AddTorque(std::span<const double> torque) {
    double change = 0;
    for (size_t a = 0; a < torque.size(); ++a) {
      episode_.peak_torque = std::max(episode_.peak_torque, std::abs(torque[a]));
      squares_ += torque[a] * torque[a];
      if (step_ > 1) change += std::abs(torque[a] - last_torque_[a]);
      last_torque_[a] = torque[a];
    }
    variation_ += change;
    goal_variation_ += change;
    goal_changes_ += change > 0 ? 1 : 0;
  }

  EvaluationRule rule_;
  double seconds_;  // of a step
  int64_t steps_, return_steps_, hold_steps_, tilt_steps_;
  double gamma_, discount_;   // γ, γᵏ
  std::vector<double> lean_;  // (bodies) rad, now
  int64_t step_ = 0;          // steps so far
  int64_t goal_since_ = -1;   // first state of the present stretch at the goal
  int64_t settled_since_ = -1;
  bool ended_ = false;               // terminated: further steps belong to another episode
  std::vector<double> last_torque_;  // (A)
  double squares_ = 0, variation_ = 0;
  double goal_variation_ = 0;  // in the present stretch at the goal
  int64_t goal_changes_ = 0;
  EvaluationEpisode episode_;
};

/// Sets the policy's value of each environment's present state, if it estimates one and its units
/// are known.
void EstimateValues(const Policy& policy, const VectorEnv& env, std::span<EpisodeTally> tallies) {
  const ValueUnits units = ValueUnitsOf(policy);
  if (units.gamma == 0 || policy.num_values() == 0) return;
  AlignedVector<float> numbers(tallies.size() * static_cast<size_t>(policy.num_values()));
  const Matrix<float> values(numbers, env.num_envs(), policy.num_values());
  policy.Values(env.obs(), values, *policy.Start(env.num_envs()));
  for (int i = 0; i < env.num_envs(); ++i) {
    tallies[static_cast<size_t>(i)].SetValue(std::ranges::max(values.row(i)) / units.reward_scale);
  }
}

/// One figure of each episode.
std::vector<double> Figures(const std::vector<const EvaluationEpisode*>& episodes,
                            double EvaluationEpisode::*figure) {
  std::vector<double> values;
  values.reserve(episodes.size());
  for (const EvaluationEpisode* episode : episodes) values.push_back(episode->*figure);
  return values;
}

/// The same of those episodes that have it.
std::vector<double> Figures(const std::vector<const EvaluationEpisode*>& episodes,
                            std::optional<double> EvaluationEpisode::*figure) {
  std::vector<double> values;
  for (const EvaluationEpisode* episode : episodes) {
    if (const std::optional<double>& value = episode->*figure) values.push_back(*value);
  }
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
      memories_.push_back(policy.Start(std::min(size_, num_envs - first)));
    }
  }

  void operator()(Matrix<const float> obs, Matrix<double> action) {
    ParallelFor(pool_, static_cast<int>(memories_.size()), [&](int slice) {
      const int first = slice * size_;
      const int count = std::min(size_, obs.rows() - first);
      policy_.Act(obs.Rows(first, count), action.Rows(first, count),
                  *memories_[static_cast<size_t>(slice)]);
    });
  }

 private:
  const Policy& policy_;
  ThreadPool* pool_;
  int size_;                                               // rows in a slice
  std::vector<std::unique_ptr<Policy::Memory>> memories_;  // one for each slice
};

}  // namespace

ValueUnits ValueUnitsOf(const Policy& policy) {
  const PolicyInfo& info = policy.info();
  if (!info.gamma || !info.reward_scale) return {};
  return {*info.gamma, *info.reward_scale};
}

Evaluation Summarize(std::span<const EvaluationEpisode> episodes, const EvaluationRule& rule) {
  std::vector<const EvaluationEpisode*> all, successful;
  Evaluation e;
  for (const EvaluationEpisode& episode : episodes) {
    all.push_back(&episode);
    if (episode.success) successful.push_back(&episode);
  }
  e.episodes = static_cast<int64_t>(all.size());
  e.successes = static_cast<int64_t>(successful.size());
  e.success_interval = WilsonInterval(e.successes, e.episodes);
  e.swing_up_seconds = QuartilesOf(Figures(successful, &EvaluationEpisode::swing_up_seconds));
  std::vector<double> settling = Figures(successful, &EvaluationEpisode::settling_seconds);
  e.settled = static_cast<int64_t>(settling.size());
  e.settling_seconds = QuartilesOf(std::move(settling));
  e.seconds = MomentsOf(Figures(all, &EvaluationEpisode::seconds));
  e.reward_sum = MomentsOf(Figures(all, &EvaluationEpisode::reward_sum));
  e.work = MomentsOf(Figures(all, &EvaluationEpisode::work));
  e.rms_torque = MomentsOf(Figures(all, &EvaluationEpisode::rms_torque));
  e.torque_variation = MomentsOf(Figures(all, &EvaluationEpisode::torque_variation));
  e.goal_variation = MomentsOf(Figures(successful, &EvaluationEpisode::goal_variation));
  e.goal_changes = MomentsOf(Figures(successful, &EvaluationEpisode::goal_changes));
  for (size_t body = 0; !successful.empty() && body < episodes.front().tilt.size(); ++body) {
    std::vector<double> tilts;
    tilts.reserve(successful.size());
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
  e.passed = e.episodes > 0 && rule.Passed(e.success_rate(), e.reward_sum.mean);
  return e;
}

std::vector<EvaluationEpisode> EvaluateEpisodes(const Policy& policy, VectorEnv& env,
                                                ThreadPool* pool, const Progress& progress) {
  const EnvSpec& spec = env.spec();
  const int n = spec.num_envs;
  SharedActing act(policy, n, pool);
  StepResult result(spec);
  std::vector<double> actions(static_cast<size_t>(n) * spec.action_limit.size());
  const Matrix<double> action(actions, n, spec.action_size());
  std::vector<EpisodeTally> tallies(static_cast<size_t>(n), EpisodeTally(policy, spec));
  EstimateValues(policy, env, tallies);

  ThreadTuner tuner(pool);
  const int64_t steps = StepsIn(spec.evaluation.seconds, spec);
  for (int64_t k = 1; k <= steps; ++k) {
    // Before the step: after the last one an environment that timed out has been reset.
    for (int i = 0; i < n; ++i) tallies[static_cast<size_t>(i)].SeeLean(env, i);
    tuner.Run([&] {
      act(env.obs(), action);
      env.Step(action, result);
    });
    for (int i = 0; i < n; ++i) tallies[static_cast<size_t>(i)].Add(result, static_cast<size_t>(i));
    if (progress) progress(n * static_cast<double>(k) / static_cast<double>(steps), n);
    if (std::ranges::all_of(tallies, &EpisodeTally::ended)) break;
  }

  std::vector<EvaluationEpisode> episodes;
  episodes.reserve(tallies.size());
  for (EpisodeTally& tally : tallies) episodes.push_back(tally.Finish());
  return episodes;
}

Evaluation Evaluate(const Policy& policy, VectorEnv& env, ThreadPool* pool,
                    const Progress& progress) {
  return Summarize(EvaluateEpisodes(policy, env, pool, progress), env.spec().evaluation);
}

}  // namespace upswing
