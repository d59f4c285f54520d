// A configuration file, as `train --config` reads it and a run folder holds it.
#include "fuzz/target.h"
#include "setup/config.h"

namespace upswing {

bool TryInput(std::string_view input) {
  Config config;
  if (!Accepts([&] { config = ParseConfig(input, kInputName, {}); })) return false;
  // What the program writes of it says the same.
  const std::string text = ConfigToml(config, false);
  Expect(ConfigToml(ParseConfig(text, kInputName, {}), false) == text,
         "to read the settings that were written");
  return true;
}

}  // namespace upswing
