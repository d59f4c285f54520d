// The training loop. N environments, K reward terms. Steps are control steps over all environments.
#include "rl/trainer.h"

#include <algorithm>
#include <chrono>
#include <numeric>

#include "base/solved.h"
#include "base/text.h"

namespace upswing {
namespace {

constexpr size_t kRecentEpisodes = 100;  // episodes in the mean return of the progress line
constexpr double kMostSeconds = 1e12;    // more than any training lasts

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

}  // namespace

Trainer::Trainer(TrainSetup setup, Agent& agent, VectorEnv& env)
    : setup_(std::move(setup)),
      agent_(agent),
      env_(env),
      state_(env.num_envs(), static_cast<int>(env.spec().term_names.size())),
      result_(env.spec()),
      action_(result_.torque.size()) {}

bool Trainer::Step() {
  if (finished()) return false;
  const TrainConfig& config = setup_.config;
  TrainState& s = state_;
  const auto begin = Clock::now();

  // Make one step of all environments, then the updates that are due.
  const Matrix<double> action(action_, env_.num_envs(), env_.spec().action_size());
  env_.SetStartNoise(config.StartNoise(s.steps));
  agent_.Act(env_.obs(), action);
  env_.Step(action, result_);
  agent_.Observe(result_);
  agent_.Learn();
  before_ = s.steps;
  s.steps += env_.num_envs();
  s.seconds += SecondsSince(begin);

  // Do the work that is due: a multiple of its interval has been reached or passed.
  CountEpisodes();
  if (IsDue(config.log_every)) {
    const Metrics metrics = agent_.TakeMetrics();
    for (TrainObserver* observer : observers_) observer->OnMetrics(s, metrics);
  }
  if (IsDue(config.eval_every) || s.steps >= config.steps) Evaluate(IsDue(config.eval_every));
  return true;
}

void Trainer::CountEpisodes() {
  TrainState& s = state_;
  const size_t K = env_.spec().term_names.size();
  for (size_t env = 0; env < s.episode_return.size(); ++env) {
    const auto sums = std::span(s.episode_terms).subspan(env * K, K);
    s.episode_return[env] += result_.reward[env];
    ++s.episode_length[env];
    for (size_t k = 0; k < K; ++k) sums[k] += result_.reward_terms[env * K + k];
    if (!result_.done(env)) continue;

    ++s.episodes;
    const FinishedEpisode episode{s.episode_return[env], s.episode_length[env],
                                  result_.terminated[env] != 0, sums};
    for (TrainObserver* observer : observers_) observer->OnEpisode(s, episode);
    if (s.recent_returns.size() == kRecentEpisodes) {
      s.recent_returns.erase(s.recent_returns.begin());
    }
    s.recent_returns.push_back(s.episode_return[env]);
    s.episode_return[env] = 0;
    s.episode_length[env] = 0;
    std::ranges::fill(sums, 0.0);
  }
}

void Trainer::Evaluate(bool scheduled) {
  TrainState& s = state_;
  const std::unique_ptr<Policy> policy = agent_.ExportPolicy({});
  Evaluation e = setup_.evaluate(*policy, s.steps);
  const bool matters = s.solved ? IsBest(e) : scheduled && s.streak == 1;
  const bool confirm = e.passed && matters && setup_.confirm;
  if (confirm) e = setup_.confirm(*policy, s.steps);
  s.last_success_rate = e.success_rate();
  // Before the task is solved, the best result comes from the milder evaluation. A confirmed policy
  // then replaces it without comparison.
  if (IsBest(e) || (confirm && !s.solved)) KeepAsBest(e);
  if (scheduled) CountStreak(e);
  for (TrainObserver* observer : observers_) observer->OnEvaluation(s, e);
}

bool Trainer::IsBest(const Evaluation& e) const {
  const TrainState& s = state_;
  const EvaluationRule& rule = env_.spec().evaluation;
  return s.best_step == 0 || rule.Score(e.success_rate(), e.reward_sum.mean) >
                                 rule.Score(s.best_success_rate, s.best_return);
}

void Trainer::KeepAsBest(const Evaluation& e) {
  TrainState& s = state_;
  PolicyInfo info = setup_.policy_info;
  info.step = s.steps;
  info.success_rate = e.success_rate();
  info.mean_return = e.reward_sum.mean;
  const std::unique_ptr<Policy> policy = agent_.ExportPolicy(info);
  for (TrainObserver* observer : observers_) observer->OnBest(s, *policy);
  s.best_success_rate = e.success_rate();
  s.best_return = e.reward_sum.mean;
  s.best_step = s.steps;
}

void Trainer::CountStreak(const Evaluation& e) {
  TrainState& s = state_;
  if (s.solved) return;
  s.solved = CountsAsSolved(e.passed, s.streak);
  if (s.streak != 1) return;
  s.streak_step = s.steps;
  s.streak_seconds = s.seconds;
}

void Trainer::State(const Archive& archive) {
  agent_.State(archive.In("agent"));
  env_.State(archive.In("env"));
  state_.State(archive.In("train"));
  archive.Check(agent_.steps() == state_.steps, "agent/steps",
                Concat(state_.steps, ", the steps of the training"));
}

constexpr Range kCount{1, 1e12};

void TrainConfig::Describe(Options& o) {
  o.Section("train");
  o.Add(&seed, "seed", {0, 9e15}, "", "seed of all random numbers").decides =
      Option::Decides::kSeed;
  o.Add(&steps, "steps", kCount, "steps", "training budget, summed over all environments").decides =
      Option::Decides::kEnd;
  o.Add(&envs, "envs", {1, 4096}, "", "number of parallel environments");
  o.Add(&stop_when_solved, "stop_when_solved", "stop when two evaluations in a row pass").decides =
      Option::Decides::kEnd;
  o.Add(&eval_every, "eval_every", kCount, "steps", "interval between evaluations");
  o.Add(&eval_episodes, "eval_episodes", {1, 100000}, "", "number of episodes per evaluation");
  o.Add(&log_every, "log_every", kCount, "steps", "interval between rows of metrics.csv");
  o.Add(&checkpoint_every, "checkpoint_every", kCount, "steps", "interval between checkpoints")
      .decides = Option::Decides::kNothing;
  o.Add(&threads, "threads", {0, 256}, "", "number of threads; 0: one per processor, at most 8")
      .decides = Option::Decides::kNothing;
  DescribeCurriculum(o);
}

void TrainConfig::DescribeCurriculum(Options& o) {
  o.Section("train");
  o.Add(&start_noise, "start_noise", {0, 10}, "rad, rad/s",
        "initial standard deviation of the start states around hanging");
  o.Add(&start_noise_end, "start_noise_end", {0, 10}, "rad, rad/s",
        "standard deviation of the start states after curriculum_steps");
  o.Add(&curriculum_steps, "curriculum_steps", kCount, "steps",
        "length of the linear change from start_noise to start_noise_end");
}

double TrainConfig::StartNoise(int64_t step) const {
  const double progress =
      std::min(1.0, static_cast<double>(step) / static_cast<double>(curriculum_steps));
  return start_noise + progress * (start_noise_end - start_noise);
}

TrainState::TrainState(int num_envs, int num_terms)
    : episode_return(static_cast<size_t>(num_envs)),
      episode_terms(static_cast<size_t>(num_envs) * static_cast<size_t>(num_terms)),
      episode_length(static_cast<size_t>(num_envs)) {}

double TrainState::mean_return() const {
  if (recent_returns.empty()) return 0;
  return std::accumulate(recent_returns.begin(), recent_returns.end(), 0.0) /
         static_cast<double>(recent_returns.size());
}

bool TrainState::Finished(const TrainConfig& config) const {
  return IsFinished(steps, config.steps, solved, config.stop_when_solved);
}

void TrainState::State(const Archive& archive) {
  const auto envs = static_cast<int64_t>(episode_length.size());
  archive.Scalar("steps", steps, {0, kMostSteps});
  archive.Check(steps % envs == 0, "steps", Concat("a multiple of ", envs, " environments"));
  archive.Scalar("episodes", episodes, {0, steps});
  archive.Scalar("seconds", seconds, {0, kMostSeconds});
  archive.Scalar("streak", streak, {0, 2});
  archive.Scalar("streak_step", streak_step, {0, steps});
  archive.Scalar("streak_seconds", streak_seconds, {0, seconds});
  archive.Scalar("solved", solved);
  archive.Check(solved == (streak == 2), "solved", "1 after a streak of 2 evaluations, else 0");
  archive.Scalar("last_success_rate", last_success_rate, {0, 1});
  archive.Scalar("best_success_rate", best_success_rate, {-1, 1});
  archive.Scalar("best_return", best_return, kAnyNumber<double>);
  archive.Scalar("best_step", best_step, {0, steps});
  archive.Check(best_step > 0 ? best_success_rate >= 0 : best_success_rate == -1,
                "best_success_rate", "0 to 1 where there is a best step, else -1");
  archive.Array("episode_return", std::span(episode_return));
  archive.Array("episode_terms", std::span(episode_terms));
  archive.Array("episode_length", std::span(episode_length), {0, steps / envs});
  archive.Vector("recent_returns", recent_returns, kRecentEpisodes);
}

}  // namespace upswing
