#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "agents/config.h"
#include "base/policy_info.h"

/// Training settings in files.
namespace upswing {

/// Runs ParseConfig on a configuration file: an empty path means no file, `-` means standard input.
/// A flag called `plant` names a plant file (runs/plant_file.h), which is a layer between the
/// configuration file and the other flags.
Config BuildConfig(const std::filesystem::path& file, const std::vector<FlagValue>& flags);

/// The path in a setting PATH or PATH#CHECKSUM.
std::string PathOfStart(const std::string& setting);

/// Loads the policy of the setting start_policy, if there is one, and adds the checksum of its
/// weights to the setting. Throws BadInput, also if the setting has another checksum.
std::shared_ptr<const Policy> StartPolicy(Config& config);

/// Reads the settings of a run folder and applies the flags. Also throws BadInput if the run's file
/// lacks a setting or has another one. Such a run is from another version: it may have used another
/// value than today's default.
Config ReadRunConfig(const std::filesystem::path& run, const std::vector<FlagValue>& flags = {});

/// Reads the settings of a variant from a regular file in a study's folder. Throws BadInput.
Config ReadSettings(const std::filesystem::path& file);

/// Adapts the settings for one of many runs: one thread unless the user set a number.
void MakeReadyForMany(Config& config);

/// Checksum that identifies the settings of a training. It ignores seed, steps and whether the
/// training stops when solved.
std::string SettingsMark(const Config& config);

/// The shell command that trains a policy like this: its agent, its seed, and a flag per setting
/// that differs from the named agent's.
///
/// Nothing if another version trained the policy, or if a setting's text does not fit on a command
/// line. Throws BadInput that begins with `where`.
std::optional<std::string> TrainCommand(const PolicyInfo& info, const std::string& where);

}  // namespace upswing
