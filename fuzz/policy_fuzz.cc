// The policy file, which `eval`, `info`, `export` and others read from untrusted sources.
#include <cmath>
#include <optional>

#include "apps/loaded_policy.h"
#include "apps/train_command.h"
#include "core/file.h"
#include "core/text.h"
#include "fuzz/target.h"

namespace upswing {

bool TryInput(std::string_view input) {
  const auto bytes = BytesOf(input);
  std::optional<LoadedPolicy> loaded;
  const bool accepted = Accepts([&] {
    loaded = ReadPolicy(TensorFile::Parse({bytes.begin(), bytes.end()}, kInputName));
  });
  if (!accepted) return false;

  // It chooses torques, and the program can print the command that trained it.
  const Policy& policy = loaded->policy;
  const std::vector<float> obs(static_cast<size_t>(policy.shape().inputs), 0.5F);
  double torque = 0;
  policy.Act(Matrix<const float>(obs.data(), 1, policy.shape().inputs), std::span(&torque, 1));
  Expect(std::isfinite(torque), "a finite torque");
  std::optional<std::string> command;
  if (Accepts([&] { command = TrainCommand(policy.info(), kInputName); }) && command) {
    Expect(Printable(*command) == *command, "a command on one line");
  }
  return true;
}

}  // namespace upswing
