// Target: policy files, which `eval`, `info`, `export` and others read from untrusted sources, and
// the policy files of `realaigym --search`.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "agents/loaded_policy.h"
#include "base/safetensors.h"
#include "base/text.h"
#include "extras/deploy/export.h"
#include "extras/realaigym/simulation.h"
#include "extras/realaigym/swing_policy.h"
#include "runs/find_policy.h"
#include "runs/train_command.h"
#include "tools/fuzz/target.h"

namespace upswing {

using namespace deploy;
using namespace realaigym;

namespace {

/// Checks a board policy: it is written as it was read, chooses finite torques from any reachable
/// state, and controls the board for a while.
void TrySwingPolicy(const Tensors& tensors) {
  const SwingPolicy policy = ReadSwingPolicy(tensors);
  const Tensors again = policy.net.ToTensors(policy.numbers);
  Expect(ReadSwingPolicy(again).numbers == policy.numbers, "the same numbers again");
  const auto finite = [](double x) { return std::isfinite(x); };
  const auto controller = policy.net.Control(policy.numbers);
  BoardMeasurement measured{};
  Lanes torque{};
  for (const double q : {0.0, 3.1, 3.2, -1e3, 1e6}) {
    measured.q1.fill(q);
    measured.q2.fill(-q);
    controller->Act(q == 0 ? 0 : 1, measured, kBoardBlock, torque);
    Expect(std::ranges::all_of(torque, finite), "finite torques");
  }
  BoardEpisode episode;
  episode.steps = 100;
  std::vector<BoardSample> trace;
  SimulateOnBoard(
      policy.net.robot(), {&episode, 1}, [&](size_t) { return policy.net.Control(policy.numbers); },
      nullptr, &trace);
  Expect(std::ranges::all_of(trace, finite, &BoardSample::torque), "finite torques of an episode");
}

}  // namespace

bool TryInput(std::string_view input) {
  const auto bytes = BytesOf(input);
  std::optional<LoadedPolicy> loaded;
  const bool accepted = Accepts([&] {
    const Tensors tensors = ReadSafetensors({bytes.begin(), bytes.end()}, kInputName);
    if (IsSwingPolicy(tensors)) return TrySwingPolicy(tensors);
    loaded = ReadPolicy(tensors);
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
