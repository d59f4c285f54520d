#include "runs/config_files.h"

#include <algorithm>
#include <utility>

#include "base/checksum.h"
#include "base/error.h"
#include "base/text.h"
#include "mujoco/mjcf_check.h"
#include "mujoco/model.h"
#include "nn/network_policy.h"
#include "os/file.h"
#include "os/streams.h"
#include "runs/find_policy.h"
#include "runs/plant_file.h"
#include "runs/run_folder.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

ModelFile ReadModel(const std::string& path) {
  ModelFile model{path, ReadOwnFile(path, kMostMjcfBytes), {}};
  model.plant = LoadModel(model.mjcf, path).plant;
  return model;
}

/// Runs ParseConfig on a file in the folder of a run or a study. The model is in the same folder.
Config ParseInFolder(const fs::path& file, const std::string& text,
                     const std::vector<FlagValue>& flags) {
  return ParseConfig(text, file.string(), flags, [&](const std::string& path, bool /*in_file*/) {
    if (path == RunFolder::kModel) return ReadModel((file.parent_path() / path).string());
    throw BadInput(Concat(file.string(), ": model: expected ", RunFolder::kModel,
                          " in the same folder, got \"", Printable(path), "\""));
  });
}

/// The path in a setting PATH or PATH#CHECKSUM.
std::string PathOfStart(const std::string& setting) {
  const size_t mark = setting.rfind('#');
  constexpr size_t kDigits = 16;
  return setting.size() - mark == 1 + kDigits ? setting.substr(0, mark) : setting;
}

}  // namespace

std::shared_ptr<const Policy> StartPolicy(Config& config) {
  if (config.start_policy.empty()) return nullptr;
  const std::string path = PathOfStart(config.start_policy);
  auto policy = LoadPolicy(path).policy;
  Checksum sum;
  if (const auto* network = dynamic_cast<const NetworkPolicy*>(policy.get())) {
    sum.Update(std::as_bytes(std::span(network->parts().parameters)));
  }
  const std::string found = Concat(path, "#", sum.Hex());
  if (config.start_policy != path && config.start_policy != found) {
    throw BadInput(Concat("start_policy: expected ", config.start_policy, ", got ", found,
                          ": the policy has changed"));
  }
  config.start_policy = found;
  return policy;
}

Config BuildConfig(const fs::path& file, const std::vector<FlagValue>& flags) {
  const std::string text = file.empty() ? "" : ReadInput(file.string());
  const std::string where = file.empty() ? "" : InputName(file.string());
  Config config =
      ParseConfig(text, where, WithPlantFile(flags), [&](const std::string& path, bool in_file) {
        return ReadModel(in_file ? (file.parent_path() / path).string() : path);
      });
  (void)StartPolicy(config);  // adds the checksum
  return config;
}

Config ReadRunConfig(const fs::path& run, const std::vector<FlagValue>& flags) {
  const fs::path file = run / RunFolder::kConfig;
  const std::string text = ReadOwnFile(file);
  std::vector<std::string> missing = MissingSettings(text, file.string(), false);
  if (missing.empty()) return ParseInFolder(file, text, flags);
  constexpr size_t kMostNames = 6;  // more names make the line unreadable
  const size_t more = missing.size() - std::min(missing.size(), kMostNames);
  missing.resize(missing.size() - more);
  throw BadInput(Concat(file.string(), ": expected every setting of this version, got none of ",
                        Join(missing, ", "), more > 0 ? Concat(" and ", more, " more") : "",
                        "; another version wrote the file"));
}

Config ReadSettings(const fs::path& file) { return ParseInFolder(file, ReadOwnFile(file), {}); }

void NameModelCopy(Config& config) {
  if (!config.mjcf.empty()) config.model = RunFolder::kModel;
}

void MakeReadyForMany(Config& config) {
  if (config.train.threads == 0) config.train.threads = 1;
  NameModelCopy(config);
}

std::string CompleteToml(Config config) {
  if (!config.model.empty()) config.model = fs::absolute(config.model).string();
  return ConfigToml(config, false);
}

std::string SettingsMark(const Config& config) {
  Config own = config;
  own.model.clear();  // the model's content counts, not its path
  Checksum sum;
  const Options options = OptionsOf(own);
  for (const Option& option : options.all()) {
    if (option.decides != Option::Decides::kTraining) continue;
    sum.Update(BytesOf(Concat(option.section, ".", option.name, "=", option.text(), "\n")));
  }
  sum.Update(BytesOf(own.mjcf));
  return sum.Hex();
}

Plant ChangedPlant(const Plant& base, const std::string& model, const std::vector<std::string>& set,
                   std::string& mjcf) {
  Plant plant = base;
  if (!model.empty()) {
    ModelFile file = ReadModel(model);
    plant = file.plant;
    mjcf = std::move(file.mjcf);
  }
  ApplyChanges(OptionsOf(plant), set);
  return plant;
}

std::optional<std::string> TrainCommand(const PolicyInfo& info, const std::string& where) {
  constexpr const char* kWhere = "metadata \"config\"";
  if (!ReplacementOf(info.agent).empty()) return std::nullopt;  // an agent of version 0.5.0
  try {
    const Config named = BuildConfig("", {{"agent", info.agent, "metadata \"agent\""}});
    if (!MissingSettings(info.config, kWhere, true).empty()) return std::nullopt;
    Config config = named;
    ApplyToml(OptionsOf(config), info.config, kWhere);

    std::string command =
        Concat("./upswing train --agent ", info.agent, " --seed ", config.train.seed);
    for (const auto& [option, usual] : Differences(OptionsOf(config), OptionsOf(named))) {
      if (option.decides == Option::Decides::kTraining) command += ' ' + option.on_command_line();
    }
    if (Printable(command) != command) return std::nullopt;
    return command;
  } catch (const Error& error) {
    throw BadInput(Concat(where, ": ", error.what()));
  }
}

}  // namespace upswing
