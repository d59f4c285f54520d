// Target: a configuration file, which `train --config` reads and a run folder holds.
#include "agents/config.h"
#include "base/error.h"
#include "base/text.h"
#include "tools/fuzz/target.h"

namespace upswing {
namespace {

Config Parse(std::string_view text) {
  return ParseConfig(text, kInputName, {},
                     [](const std::string& path, bool /*in_file*/) -> ModelFile {
                       throw BadInput(Concat("model: expected none, got ", path));
                     });
}

}  // namespace

bool TryInput(std::string_view input) {
  Config config;
  if (!Accepts([&] { config = Parse(input); })) return false;
  // The program's output of the settings has the same meaning.
  const std::string text = ConfigToml(config, false);
  Expect(ConfigToml(Parse(text), false) == text, "to read the settings that were written");
  return true;
}

}  // namespace upswing
