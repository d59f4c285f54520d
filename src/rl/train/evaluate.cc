#include "rl/train/evaluate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "base/aligned.h"
#include "base/thread_tuner.h"

namespace upswing {
namespace {

int64_t StepsIn(double seconds, const EnvSpec& spec) {
  return std::llround(seconds / spec.step_seconds);
}

/// Running results of one episode.
class EpisodeTally {
 public:
  EpisodeTally(const Policy& policy, const EnvSpec& spec)
      : rule_(spec.evaluation),
        seconds_(spec.step_seconds),
        steps_(StepsIn(rule_.seconds, spec)),
        return_steps_(StepsIn(rule_.return_seconds, spec)),
        hold_steps_(StepsIn(rule_.hold_seconds, spec)),
        tilt_steps_(StepsIn(kSteadyTiltSeconds, spec)),
        gamma_(policy.info().gamma.value_or(0)),
        discount_(gamma_ > 0 ? 1 : 0),
        lean_(static_cast<size_t>(spec.bodies)),
        torques_(spec.action_limit, seconds_) {
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
    if (settled && settled_since_ < 0) settled_since_ = torques_.steps();
    if (torques_.steps() < steps_ - tilt_steps_) return;
    for (size_t b = 0; b < lean_.size(); ++b) {
      episode_.tilt[b] += lean_[b] / static_cast<double>(tilt_steps_);
    }
  }

  /// Adds the result of environment `i` in the next step.
  void Add(const StepResult& result, size_t i) {
    if (ended_) return;
    episode_.work += result.work[i];
    const size_t A = result.torque.size() / result.work.size();
    torques_.Add(std::span(result.torque).subspan(i * A, A), result.at_goal[i] != 0);
    episode_.discounted_return += discount_ * result.reward[i];
    discount_ *= gamma_;
    const size_t terms = episode_.terms.size();
    if (torques_.steps() <= return_steps_) {
      const double weight = rule_.return_weight;
      episode_.reward_sum += weight * result.reward[i];
      for (size_t j = 0; j < terms; ++j) {
        episode_.terms[j] += weight * result.reward_terms[i * terms + j];
      }
    }
    // The last step may time out, because the rule's time is over then.
    terminated_ = result.terminated[i] != 0;
    ended_ = terminated_ || (result.truncated[i] != 0 && torques_.steps() < steps_);
  }

  /// Returns the results. Call it once, at the end.
  EvaluationEpisode Finish() {
    // A termination means success if the task judges by return; otherwise it is a numerical
    // blow-up.
    const int64_t goal_since = torques_.goal_since();
    const bool at_goal = goal_since >= 0 && (!ended_ || rule_.by_return());
    const bool settled = settled_since_ >= 0 && at_goal;
    const auto seconds = [&](int64_t steps) { return static_cast<double>(steps) * seconds_; };
    EvaluationEpisode& e = episode_;
    e.seconds = seconds(torques_.steps());
    if (at_goal) e.swing_up_seconds = seconds(goal_since);
    if (settled) e.settling_seconds = seconds(settled_since_);
    e.diverged = terminated_ && !rule_.by_return();
    e.success = rule_.by_return() ? e.reward_sum >= rule_.solved_return
                                  : at_goal && goal_since <= steps_ - hold_steps_;
    torques_.Finish(at_goal, e);
    return std::move(e);
  }

 private:
  EvaluationRule rule_;
  double seconds_;  // length of a step
  int64_t steps_, return_steps_, hold_steps_, tilt_steps_;
  double gamma_, discount_;   // γ, γᵏ
  std::vector<double> lean_;  // (bodies) rad, current lean
  TorqueTally torques_;
  int64_t settled_since_ = -1;
  bool terminated_ = false;
  bool ended_ = false;  // ended early; further steps belong to another episode
  EvaluationEpisode episode_;
};

/// Sets the policy's value of each environment's current state, if the policy estimates values and
/// their units are known.
void EstimateValues(const Policy& policy, const VectorEnv& env, std::span<EpisodeTally> tallies) {
  const PolicyInfo& info = policy.info();
  if (!info.gamma || policy.num_values() == 0) return;
  AlignedVector<float> numbers(tallies.size() * static_cast<size_t>(policy.num_values()));
  const Matrix<float> values(numbers, env.num_envs(), policy.num_values());
  policy.Values(env.obs(), values, *policy.Start(env.num_envs()));
  for (int i = 0; i < env.num_envs(); ++i) {
    tallies[static_cast<size_t>(i)].SetValue(std::ranges::max(values.row(i)) /
                                             info.reward_scale.value_or(1));
  }
}

/// The values of a figure, from the episodes that have one.
std::vector<double> ValuesOf(const EvaluationFigure& figure,
                             const std::vector<const EvaluationEpisode*>& episodes) {
  std::vector<double> values;
  values.reserve(episodes.size());
  for (const EvaluationEpisode* episode : episodes) {
    if (const std::optional<double> value = figure.Of(*episode)) values.push_back(*value);
  }
  return values;
}

double MiddleOf(double value) { return value; }
double MiddleOf(const Moments& moments) { return moments.mean; }
double MiddleOf(const Quartiles& quartiles) { return quartiles.median; }

/// Acts for all environments, in slices that a pool can share. First calls `before(i)` for each
/// environment i.
class SharedActing {
 public:
  SharedActing(const Policy& policy, int num_envs, ThreadPool* pool)
      : policy_(policy), pool_(pool) {
    // Make enough slices to balance threads of unequal speed. Fewer rows are not worth another
    // thread.
    constexpr int kSmallestSlice = 16;
    const int most = pool == nullptr ? 1 : 2 * pool->threads();
    const int slices = std::clamp(num_envs / kSmallestSlice, 1, most);
    size_ = (num_envs + slices - 1) / slices;
    for (int first = 0; first < num_envs; first += size_) {
      memories_.push_back(policy.Start(std::min(size_, num_envs - first)));
    }
  }

  template <typename Before>
  void operator()(Matrix<const float> obs, Matrix<double> action, const Before& before) {
    ParallelFor(pool_, static_cast<int>(memories_.size()), [&](int slice) {
      const int first = slice * size_;
      const int count = std::min(size_, obs.rows() - first);
      for (int i = first; i < first + count; ++i) before(i);
      policy_.Act(obs.Rows(first, count), action.Rows(first, count),
                  *memories_[static_cast<size_t>(slice)]);
    });
  }

 private:
  const Policy& policy_;
  ThreadPool* pool_;
  int size_;                                               // rows per slice
  std::vector<std::unique_ptr<Policy::Memory>> memories_;  // one per slice
};

}  // namespace

double EvaluationFigure::Of(const Evaluation& evaluation) const {
  return std::visit([&](auto member) { return MiddleOf(evaluation.*member); }, summary);
}

std::optional<double> EvaluationFigure::Of(const EvaluationEpisode& episode) const {
  return std::visit([&](auto member) { return std::optional<double>(episode.*member); }, result);
}

std::span<const EvaluationFigure> EvaluationFigures() {
  using E = Evaluation;
  using One = EvaluationEpisode;
  using enum EvaluationFigure::Known;
  static constexpr EvaluationFigure kFigures[] = {
      {"return", "mean_return", kAlways, &E::reward_sum, &One::reward_sum},
      {"swing_up_seconds", "swing_up_seconds", kUpright, &E::swing_up_seconds,
       &One::swing_up_seconds},
      {"settling_seconds", nullptr, kSettled, &E::settling_seconds, &One::settling_seconds},
      {"energy_used", "work", kAlways, &E::work, &One::work},
      {"peak_torque", nullptr, kAlways, &E::peak_torque, &One::peak_torque},
      {"rms_torque", "rms_torque", kAlways, &E::rms_torque, &One::rms_torque},
      {"torque_variation", "torque_variation", kAlways, &E::torque_variation,
       &One::torque_variation},
      {"torque_variation_upright", "torque_variation_upright", kUpright, &E::goal_variation,
       &One::goal_variation},
      {"torque_changes_upright", nullptr, kUpright, &E::goal_changes, &One::goal_changes},
      {"value", "value", kValued, &E::value, &One::value},
      {"discounted_return", "discounted_return", kValued, &E::discounted_return,
       &One::discounted_return},
  };
  return kFigures;
}

void TorqueTally::Add(std::span<const double> torque, bool at_goal) {
  ++steps_;
  double change = 0;
  bool is_chatter = false;
  for (size_t a = 0; a < torque.size(); ++a) {
    peak_ = std::max(peak_, std::abs(torque[a]));
    squares_ += torque[a] * torque[a];
    const double step = steps_ > 1 ? std::abs(torque[a] - last_[a]) : 0;
    change += step;
    is_chatter |= step > kLeastChange * limit_[a];
    last_[a] = torque[a];
  }
  variation_ += change;
  goal_variation_ += change;
  if (is_chatter) ++goal_changes_;
  if (!at_goal) goal_since_ = -1;
  if (!at_goal || goal_since_ >= 0) return;
  goal_since_ = steps_;
  goal_variation_ = goal_changes_ = 0;
}

void TorqueTally::Finish(bool at_goal, EvaluationEpisode& episode) const {
  const auto seconds = [&](int64_t steps) { return static_cast<double>(steps) * seconds_; };
  episode.peak_torque = peak_;
  episode.rms_torque = std::sqrt(squares_ / static_cast<double>(steps_));
  episode.torque_variation = variation_ / seconds(steps_);
  if (!at_goal || !has_goal_steps()) return;
  episode.goal_variation = goal_variation_ / seconds(steps_ - goal_since_);
  episode.goal_changes = static_cast<double>(goal_changes_) / seconds(steps_ - goal_since_);
}

double ValueRatio(double value, double discounted_return) {
  return discounted_return > 0 ? value / discounted_return
                               : std::numeric_limits<double>::infinity();
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
  e.diverged = std::ranges::count(episodes, true, &EvaluationEpisode::diverged);
  e.success_interval = WilsonInterval(e.successes, e.episodes);
  e.settled = std::ranges::count_if(
      successful, [](const EvaluationEpisode* one) { return one->settling_seconds.has_value(); });
  for (const EvaluationFigure& figure : EvaluationFigures()) {
    using enum EvaluationFigure::Known;
    const bool upright = figure.known == kUpright || figure.known == kSettled;
    const std::vector<double> values = ValuesOf(figure, upright ? successful : all);
    if (const auto* moments = std::get_if<Moments Evaluation::*>(&figure.summary)) {
      e.** moments = MomentsOf(values);
    } else if (const auto* times = std::get_if<Quartiles Evaluation::*>(&figure.summary)) {
      e.** times = QuartilesOf(values);
    }
  }
  std::vector<double> seconds;
  for (const EvaluationEpisode* episode : all) seconds.push_back(episode->seconds);
  e.seconds = MomentsOf(seconds);
  if (!successful.empty()) {
    for (size_t body = 0; body < episodes.front().tilt.size(); ++body) {
      std::vector<double> tilts;
      tilts.reserve(successful.size());
      for (const auto* episode : successful) tilts.push_back(std::abs(episode->tilt[body]));
      e.tilt.push_back(MomentsOf(tilts));
    }
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
  bool ended = false;
  for (int64_t k = 1; k <= steps && !ended; ++k) {
    tuner.Run([&] {
      act(env.obs(), action, [&](int i) {
        if (k > 1) tallies[i].Add(result, i);
        // Read the lean before the step, because an environment that times out resets itself in its
        // last step.
        tallies[i].SeeLean(env, i);
      });
      ended = std::ranges::all_of(tallies, &EpisodeTally::ended);
      if (!ended) env.Step(action, result);
    });
    if (progress) progress(n * static_cast<double>(k) / static_cast<double>(steps), n);
  }

  std::vector<EvaluationEpisode> episodes;
  episodes.reserve(tallies.size());
  for (int i = 0; i < n; ++i) {
    tallies[i].Add(result, i);
    episodes.push_back(tallies[i].Finish());
  }
  return episodes;
}

Evaluation Evaluate(const Policy& policy, VectorEnv& env, ThreadPool* pool,
                    const Progress& progress) {
  return Summarize(EvaluateEpisodes(policy, env, pool, progress), env.spec().evaluation);
}

}  // namespace upswing
