// Target: policy files, which `eval`, `info`, `export` and others read from untrusted sources.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "agents/loaded_policy.h"
#include "base/safetensors.h"
#include "base/text.h"
#include "extras/deploy/export.h"
#include "runs/config_files.h"
#include "runs/find_policy.h"
#include "tools/fuzz/target.h"

namespace upswing {

using namespace deploy;

bool TryInput(std::string_view input) {
  const auto bytes = BytesOf(input);
  std::optional<LoadedPolicy> loaded;
  const bool accepted = Accepts([&] {
    loaded = ReadPolicy(ReadSafetensors({bytes.begin(), bytes.end()}, kInputName));
  });
  if (!loaded) return accepted;

  // An accepted policy chooses torques, and the program can print the command that trained it.
  const Policy& policy = *loaded->policy;
  const std::vector<float> obs(static_cast<size_t>(policy.obs_size()), 0.5F);
  double torque = 0;
  policy.Act({obs.data(), 1, policy.obs_size()}, {&torque, 1, 1}, *policy.Start(1));
  Expect(std::isfinite(torque), "a finite torque");
  std::optional<std::string> command;
  if (Accepts([&] { command = TrainCommand(policy.info(), kInputName); }) && command) {
    Expect(Printable(*command) == *command, "a command on one line");
  }

  // Exported C is ASCII, and no text from the file ends its comment.
  Accepts([&] { OnnxModelOf(*loaded); });
  Accepts([&] {
    const std::string c = CHeaderOf(*loaded, "policy").text;
    Expect(std::ranges::all_of(c, [](char x) { return x == '\n' || (x >= ' ' && x <= '~'); }),
           "a C header in ASCII");
    Expect(c.substr(c.find("*/"), 12) == "*/\n#ifndef U", "a C header's comment");
  });
  return true;
}

}  // namespace upswing
