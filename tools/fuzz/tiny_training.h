#pragma once

#include "agents/training.h"
#include "agents/config.h"

namespace upswing {

/// A training in `physics` with a few hundred parameters and nearly all features switched on.
inline Config TinyConfig(const std::string& physics, const std::string& algorithm = "dqn") {
  Config config(algorithm);
  SetFlags(OptionsOf(config), {{"physics", physics},
                               {"envs", "2"},
                               {"episode_seconds", "0.1"},
                               {"memory", "1"},
                               {"sensor_noise", "0.1"},
                               {"delay", "0.04"},
                               {"randomize", "0.1"},
                               {"hidden", "3,2"},
                               {"batch", "4"},
                               {"mirror", "true"},
                               {"steps", "1e12"},
                               {"eval_every", "1e12"}});
  const std::vector<FlagValue> off_policy{
      {"replay", "6"}, {"n_step", "2"}, {"learning_starts", "4"}, {"updates_per_step", "0.5"}};
  if (algorithm == "ppo") {
    SetFlags(OptionsOf(config), {{"horizon", "4"}, {"epochs", "2"}, {"value_clip", "0.2"}});
  } else if (algorithm == "sac") {
    SetFlags(OptionsOf(config), off_policy);
    SetFlags(OptionsOf(config), {{"smoothness", "0.1"}});
  } else {
    SetFlags(OptionsOf(config), off_policy);
    SetFlags(OptionsOf(config), {{"head", "2"}});
  }
  return config;
}

}  // namespace upswing
