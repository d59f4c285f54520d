#pragma once

#include <cstdint>

#include "base/options.h"

namespace upswing {

/// Settings of the training loop. "Steps" are control steps, counted over all environments.
struct TrainConfig {
  int64_t steps = 1000000, envs = 32, seed = 1;
  int64_t eval_every = 10000, eval_episodes = 100, log_every = 2000, checkpoint_every = 50000;
  bool stop_when_solved = true;
  int64_t threads = 0;
  double start_noise = 0.1, start_noise_end = 0.1;
  int64_t curriculum_steps = 200000;

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);
  /// Describes only the settings of the curriculum.
  void DescribeCurriculum(Options& options);

  /// Standard deviation of the start states' noise at a step (the curriculum). It changes linearly
  /// over curriculum_steps.
  double StartNoise(int64_t step) const;
};

}  // namespace upswing
