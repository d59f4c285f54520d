// Trains with only the portable layers (base, nn, pendulum, rl, control, agents): in memory, in
// closed form, with a checkpoint in safetensors format. The program links all of these libraries
// and no others of ours. portable_test.py checks its requirements on the system.
#include <algorithm>
#include <cstdio>
#include <vector>

#include "agents/training.h"
#include "base/error.h"
#include "base/safetensors.h"

namespace upswing {
namespace {

Config SmallSettings() {
  const std::vector<FlagValue> flags{{"physics", "closed-form"},
                                     {"eval_physics", "closed-form"},
                                     {"envs", "8"},
                                     {"steps", "4000"},
                                     {"eval_every", "2000"},
                                     {"eval_episodes", "4"},
                                     {"hidden", "16,16"},
                                     {"head", "8"},
                                     {"learning_starts", "200"},
                                     {"threads", "2"}};
  return ParseConfig("", "", flags);
}

/// A small training with two threads.
Training SmallTraining() {
  constexpr int64_t kMemory = int64_t{1} << 30;
  return Training(SmallSettings(), {nullptr, kMemory, 2});
}

/// The training's checkpoint as a file in memory.
std::vector<std::byte> FileOf(Training& training) {
  const Tensors checkpoint = training.Checkpoint();
  return WriteSafetensors(checkpoint).Joined();
}

/// Whether two checkpoints have the same tensors, without the trainings' times.
bool Same(const Tensors& a, const Tensors& b) {
  if (a.all().size() != b.all().size()) return false;
  for (const auto& [name, tensor] : a.all()) {
    const auto other = b.all().find(name);
    if (other == b.all().end() || tensor.shape != other->second.shape) return false;
    if (name == "train/seconds" || name == "train/streak_seconds") continue;
    if (!std::ranges::equal(tensor.bytes, other->second.bytes)) return false;
  }
  return true;
}

/// Checks that a training saved half-way and loaded into another one continues unchanged.
void CheckThatItResumes() {
  Training whole = SmallTraining(), resumed = SmallTraining();
  while (whole.state().steps < 2000) whole.Step();
  const std::vector<std::byte> half = FileOf(whole);
  resumed.Load(ReadSafetensors(half, "half"));
  while (whole.Step()) continue;
  while (resumed.Step()) continue;
  const Tensors end = ReadSafetensors(FileOf(whole), "whole");
  if (!Same(end, ReadSafetensors(FileOf(resumed), "resumed"))) {
    throw Failure("resumed: expected the checkpoint of a training that was not stopped");
  }
  if (Same(end, ReadSafetensors(half, "half"))) throw Failure("the training changed nothing");
  std::printf("%d updates in %d steps, resumed at 2000 to the same bits\n",
              static_cast<int>(whole.agent().updates()), static_cast<int>(whole.state().steps));
}

}  // namespace
}  // namespace upswing

int main() try { upswing::CheckThatItResumes(); } catch (const upswing::Error& error) {
  std::printf("%s\n", error.what());
  return error.exit_code();
}
