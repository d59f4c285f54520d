#include "runs/config_files.h"

#include <algorithm>

#include "base/checksum.h"
#include "base/error.h"
#include "base/text.h"
#include "nn/network_policy.h"
#include "os/file.h"
#include "os/streams.h"
#include "runs/find_policy.h"
#include "runs/plant_file.h"
#include "runs/run_folder.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// The first names, as many as fit into a readable line: `a, b and 3 more`.
std::string FirstOf(std::vector<std::string> names) {
  constexpr size_t kMostNames = 6;
  if (names.size() <= kMostNames) return Join(names, ", ");
  const size_t more = names.size() - kMostNames;
  names.resize(kMostNames);
  return Concat(Join(names, ", "), " and ", more, " more");
}

/// Loads the policy for start_policy. Throws BadInput that begins with the setting.
std::shared_ptr<const Policy> PolicyToStart(const std::string& path) {
  try {
    return LoadPolicy(path).policy;
  } catch (const Error& error) {
    throw Error(error.exit_code(), Concat("start_policy: ", error.what()));
  }
}

}  // namespace

std::string PathOfStart(const std::string& setting) {
  const size_t mark = setting.rfind('#');
  if (mark == std::string::npos) return setting;
  constexpr size_t kDigits = 16;
  return setting.size() - mark == 1 + kDigits ? setting.substr(0, mark) : setting;
}

std::shared_ptr<const Policy> StartPolicy(Config& config) {
  if (config.start_policy.empty()) return nullptr;
  const std::string path = PathOfStart(config.start_policy);
  auto policy = PolicyToStart(path);
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
  Config config = ParseConfig(text, where, WithPlantFile(flags));
  CheckNamingFlags(flags, where, [&] { (void)StartPolicy(config); });  // adds the checksum
  return config;
}

Config ReadRunConfig(const fs::path& run, const std::vector<FlagValue>& flags) {
  const fs::path file = run / RunFolder::kConfig;
  const std::string text = ReadOwnFile(file);
  const RecordedConfig record = ReadRecord(text, file.string());
  if (!record.missing.empty()) {
    throw BadInput(Concat(file.string(), ": expected every setting of this version, got none of ",
                          FirstOf(record.missing), "; another version wrote the file"));
  }
  if (!record.unknown.empty()) {
    throw BadInput(Concat(file.string(), ": expected only settings of this version, got ",
                          FirstOf(record.unknown), "; another version wrote the file"));
  }
  return ParseConfig(text, file.string(), flags);
}

Config ReadSettings(const fs::path& file) {
  return ParseConfig(ReadOwnFile(file), file.string(), {});
}

void MakeReadyForMany(Config& config) {
  if (config.train.threads == 0) config.train.threads = 1;
}

std::string SettingsMark(const Config& config) {
  Config used = config;
  used.randomization.DropUnused();
  Checksum sum;
  const Options options = OptionsOf(used);
  for (const Option& option : options.all()) {
    if (option.decides != Option::Decides::kTraining) continue;
    sum.Update(BytesOf(Concat(option.section, ".", option.name, "=", option.text(), "\n")));
  }
  return sum.Hex();
}

std::optional<std::string> TrainCommand(const PolicyInfo& info, const std::string& where) {
  constexpr const char* kWhere = "metadata \"config\"";
  if (info.upswing_version != UPSWING_VERSION) return std::nullopt;
  try {
    const Config config = ReadRecord(info.config, kWhere).config;
    const Config named = BuildConfig("", {{"agent", info.agent, "metadata \"agent\""}});
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
