#include "rl/train/train_config.h"

#include "rl/schedule.h"

namespace upswing {

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
  return Scheduled(start_noise, start_noise_end, step, curriculum_steps);
}

}  // namespace upswing
