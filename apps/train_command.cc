#include "apps/train_command.h"

#include "apps/config.h"
#include "apps/toml_settings.h"
#include "core/error.h"
#include "core/text.h"

namespace upswing {

std::optional<std::string> TrainCommand(const Policy& policy, const std::string& where) {
  constexpr const char* kWhere = "metadata \"config\"";
  try {
    const std::string& agent = policy.About("agent");
    const std::string& settings = policy.About("config");
    Config named = BuildConfig("", {{"agent", agent}});
    if (!MissingSettings(settings, kWhere, true).empty()) return std::nullopt;
    Config config = named;
    ApplyToml(OptionsOf(config), settings, kWhere);

    const std::vector<Option> before = TrainingSettings(named);
    const std::vector<Option> now = TrainingSettings(config);
    std::string command = Concat("./upswing train --agent ", agent, " --seed ", config.train.seed);
    for (size_t i = 0; i < now.size(); ++i) {
      if (now[i].text() != before[i].text()) command += ' ' + now[i].on_command_line();
    }
    return command;
  } catch (const Error& error) {
    throw BadInput(Concat(where, ": ", error.what()));
  }
}

}  // namespace upswing
