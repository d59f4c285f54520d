#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/options.h"
#include "core/vector_env.h"
#include "rl/agent.h"
#include "rl/evaluate.h"
#include "rl/run_folder.h"

namespace upswing {

/// Settings of the training loop. "Steps" are control steps, counted over all environments.
struct TrainConfig {
  int64_t steps, envs, seed;
  int64_t eval_every, eval_episodes, log_every, checkpoint_every;
  bool stop_when_solved;
  int64_t threads;
  double start_noise, start_noise_end;
  int64_t curriculum_steps;

  TrainConfig() { SetDefaults(*this); }
  /// One line per setting: name, default, range, unit, help.
  void Describe(Options& options);

  /// The curriculum: noise of the start states, rising linearly over curriculum_steps.
  double StartNoise(int64_t step) const;
};

/// Where a training stands, apart from agent and environments.
struct TrainState {
  int64_t steps = 0, episodes = 0;
  double seconds = 0;         // of training, evaluations excluded
  int64_t checkpoint_at = 0;  // step of the last checkpoint
  int64_t streak = 0;         // evaluations in a row in which all episodes succeed, until solved
  int64_t streak_step = 0;    // step of the streak's first
  double streak_seconds = 0;  // training time then: the time to solve, once solved
  bool solved = false;        // two such evaluations in a row
  double last_success_rate = 0;
  double best_success_rate = -1, best_return = 0;
  int64_t best_step = 0;
  std::vector<double> episode_return, episode_terms;  // (N), (N × K) of the running episodes
  std::vector<int64_t> episode_length;                // (N) steps
  std::vector<double> recent_returns;                 // of the last episodes, newest last

  TrainState(int num_envs, int num_terms);
  double mean_return() const;
  void State(const Archive& archive);
};

/// What a user may request during a training.
enum class TrainRequest { kGoOn, kCheckpoint, kStop };

/// All that a training needs; the loop owns none of it.
struct Training {
  TrainConfig config;
  Agent& agent;
  VectorEnv& env;
  RunFolder& run;
  /// Evaluates the policy of a step from new start states, different ones at each step.
  std::function<Evaluation(const Policy&, int64_t step)> evaluate = {};
  /// Origin of the policy for its file, to which the step and the evaluation's results are added.
  PolicyInfo policy_info = {};
  /// What the checkpoint's metadata hold: version and configuration.
  std::map<std::string, std::string> checkpoint_metadata = {};

  // Called during the training; any may be empty.
  std::function<void(const TrainState&, const AgentReport&)> on_metrics = {};
  std::function<void(const TrainState&, const Evaluation&)> on_evaluation = {};
  std::function<void(const TrainState&)> on_step = {};
  std::function<TrainRequest()> poll = {};
};

/// Saves or loads the whole state of a training; see Archive.
void CheckpointState(const Archive& archive, Agent& agent, VectorEnv& env, TrainState& state);

/// Trains until the task is solved, the steps are done or `poll` asks to stop; writes tables,
/// evaluations, the best policy and checkpoints into the run folder. Throws Failure that names the
/// step and the last complete checkpoint. Returns false if it was asked to stop.
bool Train(Training& training, TrainState& state);

}  // namespace upswing
