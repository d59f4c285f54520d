// The training loop. N environments, K reward terms; steps are control steps over all environments.
#include "rl/train.h"

#include <algorithm>
#include <chrono>
#include <numeric>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

constexpr size_t kRecentEpisodes = 100;  // in the mean return that the progress line shows
constexpr double kMostSeconds = 1e12;    // more than any training lasts

/// Seconds since the last call.
class Stopwatch {
 public:
  double Lap() {
    const auto now = Clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
};

/// Adds one step of all environments to their episodes and logs the episodes that it finished.
void CountEpisodes(const StepResult& result, const std::vector<std::string>& term_names,
                   TrainState& s, RunFolder& run) {
  const size_t terms = term_names.size();
  for (size_t env = 0; env < s.episode_return.size(); ++env) {
    const auto sums = std::span(s.episode_terms).subspan(env * terms, terms);
    s.episode_return[env] += result.reward[env];
    ++s.episode_length[env];
    for (size_t k = 0; k < terms; ++k) sums[k] += result.reward_terms[env * terms + k];
    if (!result.done(env)) continue;

    ++s.episodes;
    Row row{{"step", s.steps},
            {"episode", s.episodes},
            {"return", s.episode_return[env]},
            {"length", s.episode_length[env]},
            {"terminated", result.terminated[env]}};
    for (size_t k = 0; k < terms; ++k) row.emplace_back(term_names[k], sums[k]);
    run.LogEpisode(row);
    if (s.recent_returns.size() == kRecentEpisodes)
      s.recent_returns.erase(s.recent_returns.begin());
    s.recent_returns.push_back(s.episode_return[env]);
    s.episode_return[env] = 0;
    s.episode_length[env] = 0;
    std::ranges::fill(sums, 0.0);
  }
}

void LogMetrics(Training& t, const TrainState& s) {
  const AgentReport report = t.agent.Report();
  t.agent.BeginReport();
  t.run.LogMetrics({{"step", s.steps},
                    {"episodes", s.episodes},
                    {"updates", report.updates},
                    {"epsilon", report.epsilon},
                    {"learning_rate", report.learning_rate},
                    {"loss", report.loss},
                    {"q", report.q},
                    {"td_error", report.td_error},
                    {"gradient_norm", report.gradient_norm},
                    {"feature_rank", report.feature_rank},
                    {"dormant_share", report.dormant_share},
                    {"mean_return", s.mean_return()},
                    {"success_rate", s.last_success_rate},
                    {"seconds", s.seconds}});
  if (t.on_metrics) t.on_metrics(s, report);
}

/// Writes the policy if it is the best so far: by its success rate, then by its return.
void KeepIfBest(Training& t, TrainState& s, const Evaluation& e) {
  const double rate = e.success_rate();
  const double mean_return = e.reward_sum.mean;
  if (std::pair(rate, mean_return) <= std::pair(s.best_success_rate, s.best_return)) return;
  PolicyInfo info = t.policy_info;
  info.step = s.steps;
  info.success_rate = rate;
  info.mean_return = mean_return;
  t.agent.ExportPolicy(info).Save(t.run.policy_path());
  s.best_success_rate = rate;
  s.best_return = mean_return;
  s.best_step = s.steps;
}

/// Solved: all episodes of two evaluations in a row succeed.
void CountStreak(TrainState& s, const Evaluation& e) {
  if (s.solved) return;
  if (!e.all_succeeded()) {
    s.streak = 0;
    return;
  }
  if (++s.streak == 1) {
    s.streak_step = s.steps;
    s.streak_seconds = s.seconds;
  }
  s.solved = s.streak == 2;
}

void LogEvaluation(Training& t, const TrainState& s, const Evaluation& e) {
  t.run.LogEvaluation({{"step", s.steps},
                       {"success_rate", e.success_rate()},
                       {"success_low", e.success_interval.low},
                       {"success_high", e.success_interval.high},
                       {"mean_return", e.reward_sum.mean},
                       {"swing_up_seconds", e.swing_up_seconds.median},
                       {"work", e.work.mean},
                       {"rms_torque", e.rms_torque.mean},
                       {"value", e.value},
                       {"discounted_return", e.discounted_return},
                       {"seconds", s.seconds}});
  t.run.Log(Concat("step ", s.steps, ": ", e.successes, " of ", e.episodes,
                   " episodes succeed, mean return ", FormatNumber(e.reward_sum.mean)));
  if (t.on_evaluation) t.on_evaluation(s, e);
}

/// Evaluates the present policy. An unscheduled final evaluation does not count towards `solved`.
void JudgePolicy(Training& t, TrainState& s, bool scheduled) {
  const Evaluation e = t.evaluate(t.agent.ExportPolicy({}), s.steps);
  s.last_success_rate = e.success_rate();
  KeepIfBest(t, s, e);
  if (scheduled) CountStreak(s, e);
  LogEvaluation(t, s, e);
}

void SaveCheckpoint(Training& t, TrainState& s) {
  TensorFile checkpoint;
  checkpoint.metadata = t.checkpoint_metadata;
  CheckpointState(Archive::Saver(checkpoint), t.agent, t.env, s);
  t.run.SaveCheckpoint(checkpoint);
  s.checkpoint_at = s.steps;
}

/// The loop itself; see Train.
bool RunLoop(Training& t, TrainState& s) {
  const TrainConfig& config = t.config;
  const std::vector<std::string> term_names = t.env.reward_term_names();
  StepResult result = t.env.MakeResult();
  std::vector<double> torque(static_cast<size_t>(t.env.num_envs()));
  Stopwatch watch;

  while (s.steps < config.steps && !(s.solved && config.stop_when_solved)) {
    // One step of all environments, then the updates that are due.
    t.env.SetStartNoise(config.StartNoise(s.steps));
    t.agent.Act(t.env.obs(), torque);
    t.env.Step(torque, result);
    t.agent.Observe(result);
    t.agent.Learn();
    const int64_t before = s.steps;
    s.steps += t.env.num_envs();
    s.seconds += watch.Lap();

    // What is due at this step, as a multiple of its interval has been reached or passed: logging,
    // evaluation, checkpoint.
    const auto due = [&](int64_t every) { return s.steps / every != before / every; };
    CountEpisodes(result, term_names, s, t.run);
    if (due(config.log_every)) LogMetrics(t, s);
    if (due(config.eval_every) || s.steps >= config.steps) {
      JudgePolicy(t, s, due(config.eval_every));
      watch.Lap();  // evaluations are not training
    }
    if (t.on_step) t.on_step(s);
    const TrainRequest request = t.poll ? t.poll() : TrainRequest::kGoOn;
    if (due(config.checkpoint_every) || request != TrainRequest::kGoOn) SaveCheckpoint(t, s);
    if (request == TrainRequest::kStop) return false;
  }
  if (s.checkpoint_at != s.steps) SaveCheckpoint(t, s);
  return true;
}

}  // namespace

void TrainConfig::Describe(Options& o) {
  constexpr Range kCount{1, 1e12};
  o.Section("train");
  o.Add(&seed, "seed", 1, {0, 9e15}, "", "seed of every random stream");
  o.Add(&steps, "steps", 1000000, kCount, "steps", "train for at most this many in all").identity =
      false;
  o.Add(&envs, "envs", 32, {1, 4096}, "", "parallel environments");
  o.Add(&stop_when_solved, "stop_when_solved", true,
        "stop once all episodes of two evaluations in a row succeed")
      .identity = false;
  o.Add(&eval_every, "eval_every", 10000, kCount, "steps", "from one evaluation to the next");
  o.Add(&eval_episodes, "eval_episodes", 100, {1, 100000}, "", "episodes of an evaluation");
  o.Add(&log_every, "log_every", 2000, kCount, "steps", "from one row of metrics.csv to the next");
  o.Add(&checkpoint_every, "checkpoint_every", 50000, kCount, "steps",
        "from one checkpoint to the next")
      .identity = false;
  o.Add(&threads, "threads", 0, {0, 256}, "",
        "threads to use; 0: one for each processor, at most 8")
      .identity = false;
  o.Add(&start_noise, "start_noise", 0.1, {0, 10}, "rad, rad/s",
        "standard deviation of the start states around hanging");
  o.Add(&start_noise_end, "start_noise_end", 0.1, {0, 10}, "rad, rad/s", "at the curriculum's end");
  o.Add(&curriculum_steps, "curriculum_steps", 200000, kCount, "steps",
        "over which the noise changes linearly");
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

void TrainState::State(const Archive& archive) {
  const auto envs = static_cast<int64_t>(episode_length.size());
  archive.Scalar("steps", steps, {0, kMostSteps});
  archive.Check(steps % envs == 0, "steps", Concat("a multiple of ", envs, " environments"));
  archive.Scalar("episodes", episodes, {0, steps});
  archive.Scalar("seconds", seconds, {0, kMostSeconds});
  if (archive.loading()) checkpoint_at = steps;
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

void CheckpointState(const Archive& archive, Agent& agent, VectorEnv& env, TrainState& state) {
  agent.State(archive.In("agent"));
  env.State(archive.In("env"));
  state.State(archive.In("train"));
  archive.Check(agent.steps() == state.steps, "agent/steps",
                Concat(state.steps, ", the steps of the training"));
}

bool Train(Training& training, TrainState& state) {
  try {
    return RunLoop(training, state);
  } catch (const Error& error) {
    throw Failure(Concat("training stopped at step ", state.steps, ": ", error.what(),
                         "; the checkpoint of step ", state.checkpoint_at, " is kept in ",
                         training.run.path().string()));
  }
}

}  // namespace upswing
