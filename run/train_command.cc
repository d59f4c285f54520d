#include "run/train_command.h"

#include "core/error.h"
#include "core/text.h"
#include "setup/config.h"

namespace upswing {

std::optional<std::string> TrainCommand(const PolicyInfo& info, const std::string& where) {
  constexpr const char* kWhere = "metadata \"config\"";
  try {
    Config named = BuildConfig("", {{"agent", info.agent, "metadata \"agent\""}});
    if (!MissingSettings(info.config, kWhere, true).empty()) return std::nullopt;
    Config config = named;
    ApplyToml(OptionsOf(config), info.config, kWhere);

    const std::vector<Option> before = TrainingSettings(named);
    const std::vector<Option> now = TrainingSettings(config);
    std::string command =
        Concat("./upswing train --agent ", info.agent, " --seed ", config.train.seed);
    for (size_t i = 0; i < now.size(); ++i) {
      if (now[i].text() != before[i].text()) command += ' ' + now[i].on_command_line();
    }
    if (Printable(command) != command) return std::nullopt;
    return command;
  } catch (const Error& error) {
    throw BadInput(Concat(where, ": ", error.what()));
  }
}

}  // namespace upswing
