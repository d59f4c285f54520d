#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "judge/trial.h"

/// The flags with which `eval`, `simulate` and `plot` try a policy out.
namespace upswing {

/// Adds --set, --model, --physics, --seed (of `seed_of`), --unknown-plant, and the settings of
/// Disturbance and Randomization.
void AddTrialOptions(CLI::App& app, TrialArguments& a, const std::string& seed_of);

/// Adds --start and --episode.
void AddEpisodeOptions(CLI::App& app, EpisodeArguments& a);

}  // namespace upswing
