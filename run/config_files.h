#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "setup/config.h"

/// Settings of trainings, and models, in files.
namespace upswing {

/// ParseConfig of a configuration file (none if empty, standard input if `-`).
Config BuildConfig(const std::filesystem::path& file, const std::vector<FlagValue>& flags);

/// The settings of a run folder, changed by the flags. Throws BadInput, too, if the run's own file
/// lacks one: that run is of another version, and today's default is not what it was made with.
Config ReadRunConfig(const std::filesystem::path& run, const std::vector<FlagValue>& flags = {});

/// The settings of a variant in a study's folder, a regular file. A model in it is the copy beside
/// it. Throws BadInput.
Config ReadSettings(const std::filesystem::path& file);

/// Names the copy of a model file in the run's folder, wherever that lies, in place of the file.
void NameModelCopy(Config& config);

/// Sets what differs in a run among many: it has one thread unless more are asked for, and its
/// model lies beside it.
void MakeReadyForMany(Config& config);

/// ConfigToml with comments, for a file that may lie anywhere: the model's path is absolute.
std::string CompleteToml(Config config);

/// What identifies the settings of trainings, but for seed, steps and whether they stop when
/// solved: a checksum.
std::string SettingsMark(const Config& config);

/// The plant to try something on: `base`, or that of the model file if there is one, with the
/// given changes ("mass2=1.2"). Reads the model into `mjcf`. Throws BadInput.
Plant ChangedPlant(const Plant& base, const std::string& model, const std::vector<std::string>& set,
                   std::string& mjcf);

}  // namespace upswing
