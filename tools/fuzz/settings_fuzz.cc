// Target: a configuration file, which `train --config` reads and a run folder holds.
#include "agents/config.h"
#include "tools/fuzz/target.h"

namespace upswing {

bool TryInput(std::string_view input) {
  Config config;
  if (!Accepts([&] { config = ParseConfig(input, kInputName, {}); })) return false;
  // The program's output of the settings has the same meaning.
  const std::string text = ConfigToml(config, false);
  Expect(ConfigToml(ParseConfig(text, kInputName, {}), false) == text,
         "to read the settings that were written");
  return true;
}

}  // namespace upswing
