#include "rl/train/train_state.h"

#include <algorithm>
#include <span>

#include "base/sample.h"
#include "base/solved.h"
#include "base/steps.h"
#include "base/text.h"
#include "rl/train/trainer.h"

namespace upswing {
namespace {

constexpr size_t kRecentEpisodes = 100;  // episodes in the mean return of the progress line
constexpr double kMostSeconds = 1e12;    // more than any training lasts

}  // namespace

TrainState::TrainState(int num_envs, int num_terms)
    : episode_return(static_cast<size_t>(num_envs)),
      episode_terms(static_cast<size_t>(num_envs) * static_cast<size_t>(num_terms)),
      episode_length(static_cast<size_t>(num_envs)) {}

TrainState TrainState::WithoutEpisodes() const {
  TrainState copy(0, 0);
  copy.TakeEvaluations(*this);
  copy.steps = steps;
  copy.episodes = episodes;
  copy.seconds = seconds;
  copy.recent_returns = recent_returns;
  return copy;
}

double TrainState::mean_return() const { return MomentsOf(recent_returns).mean; }

bool TrainState::Finished(const TrainConfig& config) const {
  return IsFinished(steps, config.steps, solved, config.stop_when_solved);
}

std::optional<FinishedEpisode> TrainState::AddStep(const StepResult& result, size_t env) {
  const size_t K = episode_terms.size() / episode_length.size();
  const auto sums = std::span(episode_terms).subspan(env * K, K);
  episode_return[env] += result.reward[env];
  ++episode_length[env];
  for (size_t k = 0; k < K; ++k) sums[k] += result.reward_terms[env * K + k];
  if (!result.done(env)) return std::nullopt;

  ++episodes;
  FinishedEpisode episode{episode_return[env],
                          episode_length[env],
                          result.terminated[env] != 0,
                          {sums.begin(), sums.end()}};
  if (recent_returns.size() == kRecentEpisodes) recent_returns.erase(recent_returns.begin());
  recent_returns.push_back(episode_return[env]);
  episode_return[env] = 0;
  episode_length[env] = 0;
  std::ranges::fill(sums, 0.0);
  return episode;
}

void TrainState::DropEpisodes() {
  std::ranges::fill(episode_return, 0);
  std::ranges::fill(episode_terms, 0);
  std::ranges::fill(episode_length, 0);
}

bool TrainState::IsBest(const Evaluation& e, const EvaluationRule& rule) const {
  return best_step == 0 || rule.Score(e.success_rate(), e.reward_sum.mean) >
                               rule.Score(best_success_rate, best_return);
}

void TrainState::CountStreak(const Evaluation& e) {
  if (solved) return;
  solved = CountsAsSolved(e.passed, streak);
  if (streak != 1) return;
  streak_step = steps;
  streak_seconds = seconds;
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

void Trainer::State(const Archive& archive) {
  FinishEvaluation();
  agent_.State(archive.In("agent"));
  env_.State(archive.In("env"));
  state_.State(archive.In("train"));
  archive.Check(agent_.steps() == state_.steps, "agent/steps",
                Concat(state_.steps, ", the steps of the training"));
  const Matrix<const float> broken_off = env_.broken_off();
  if (!archive.loading() || broken_off.rows() == 0) return;
  agent_.Truncate(broken_off);
  state_.DropEpisodes();
}

}  // namespace upswing
