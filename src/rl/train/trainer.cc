// The training loop of N environments. Steps are control steps, counted over all environments.
#include "rl/train/trainer.h"

#include <optional>
#include <utility>

#include "base/stopwatch.h"

namespace upswing {

Trainer::Trainer(const TrainConfig& config, Agent& agent, VectorEnv& env, Evaluator& evaluator,
                 PolicyInfo info)
    : config_(config),
      info_(std::move(info)),
      agent_(agent),
      env_(env),
      evaluator_(evaluator),
      state_(env.num_envs(), static_cast<int>(env.spec().term_names.size())),
      result_(env.spec()),
      action_(result_.torque.size()) {}

bool Trainer::Step() {
  if (background_ && HasEnded(*background_)) FinishEvaluation();
  if (finished()) return false;
  try {
    Advance();
  } catch (...) {
    FinishEvaluationQuietly();  // its policy may be the best one
    throw;
  }
  return true;
}

void Trainer::Advance() {
  TrainState& s = state_;
  const Stopwatch watch;

  // Make one step of all environments, then the updates that are due.
  const Matrix<double> action(action_, env_.num_envs(), env_.spec().action_size());
  env_.SetStartNoise(config_.StartNoise(s.steps));  // the curriculum
  agent_.Act(env_.obs(), action);
  env_.Step(action, result_);
  agent_.Observe(result_);
  agent_.Learn();
  before_ = s.steps;
  s.steps += env_.num_envs();
  s.seconds += watch.seconds();

  // Do the work that is due: a multiple of its interval has been reached or passed.
  for (int env = 0; env < env_.num_envs(); ++env) {
    if (const std::optional<FinishedEpisode> episode = s.AddStep(result_, env)) {
      NotifyOrDefer(
          [episode](TrainObserver& o, const TrainState& state) { o.OnEpisode(state, *episode); });
    }
  }
  if (IsDue(config_.log_every)) {
    const Metrics metrics = agent_.TakeMetrics();
    NotifyOrDefer(
        [metrics](TrainObserver& o, const TrainState& state) { o.OnMetrics(state, metrics); });
  }
  if (IsDue(config_.eval_every) || s.steps >= config_.steps) Evaluate(IsDue(config_.eval_every));
}

}  // namespace upswing
