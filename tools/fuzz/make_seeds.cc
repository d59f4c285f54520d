// Writes the corpus inputs that trainings create. Run it after a change of the file formats:
//   fuzz_seeds tools/fuzz/corpus
// The small policies of other kinds there stay as they are: files of other writers do not change.
#include <cstdio>
#include <filesystem>

#include "agents/loaded_policy.h"
#include "base/error.h"
#include "runs/tensor_file.h"
#include "runs/this_host.h"
#include "tools/fuzz/tiny_training.h"

namespace upswing {

namespace {

namespace fs = std::filesystem;

/// Saves a checkpoint of a training; the fuzz target knows this kind of training as `kind`.
void SaveCheckpoint(Training& training, const std::string& kind, const fs::path& file) {
  Tensors checkpoint;
  if (kind != "closed-form") checkpoint.metadata[kind] = "";
  training.State(Archive::Saver(checkpoint));
  SaveTensors(checkpoint, file);
}

void MakeSeeds(const fs::path& corpus) {
  for (const std::string kind : {"closed-form", "mujoco", "sac", "ppo"}) {
    const bool actor = kind == "sac" || kind == "ppo";
    const Config config = actor ? TinyConfig("closed-form", kind) : TinyConfig(kind);
    Training training(config, ThisHost(1));
    SaveCheckpoint(training, kind, corpus / "checkpoint/accepted" / (kind + "-new.safetensors"));
    // Step until the replay memory is full, and into the middle of a rollout.
    for (int step = 0; step < 9; ++step) training.Step();
    SaveCheckpoint(training, kind, corpus / "checkpoint/accepted" / (kind + ".safetensors"));

    PolicyInfo info = InfoOf(config);
    info.step = 18;
    info.success_rate = 0.5;
    info.mean_return = -12.5;
    const fs::path file =
        corpus / "policy/accepted" / ((actor ? kind : "dueling-" + kind) + ".safetensors");
    SaveTensors(training.agent().ExportPolicy(info)->ToTensors(), file);
  }
}

}  // namespace
}  // namespace upswing

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "fuzz_seeds: expected the folder of the corpus\n");
    return 2;
  }
  try {
    upswing::MakeSeeds(argv[1]);
    return 0;
  } catch (const upswing::Error& error) {
    std::fprintf(stderr, "fuzz_seeds: %s\n", error.what());
    return error.exit_code();
  }
}
