#include "runs/train_command.h"

#include "agents/config.h"
#include "base/error.h"
#include "base/text.h"
#include "runs/config_files.h"

namespace upswing {

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
