// Writes those inputs of the corpus that the program itself makes; to be run after a change of its
// formats:
//   fuzz_seeds fuzz/corpus
#include <cstdio>
#include <filesystem>

#include "core/error.h"
#include "fuzz/tiny_training.h"
#include "io/tensor_file.h"
#include "lab/loaded_policy.h"
#include "nn/q_policy.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// A checkpoint after a few steps, when the replay memory is full.
void SaveCheckpoint(Training& training, const std::string& physics, const fs::path& file) {
  Tensors checkpoint;
  if (physics == "mujoco") checkpoint.metadata["mujoco"] = "";
  training.State(Archive::Saver(checkpoint));
  SaveTensors(checkpoint, file);
}

void MakeSeeds(const fs::path& corpus) {
  for (const std::string physics : {"closed-form", "mujoco"}) {
    const Config config = TinyConfig(physics);
    Training training(config, 1);
    SaveCheckpoint(training, physics,
                   corpus / "checkpoint/accepted" / (physics + "-new.safetensors"));
    for (int step = 0; step < 9; ++step) training.Step();
    SaveCheckpoint(training, physics, corpus / "checkpoint/accepted" / (physics + ".safetensors"));

    PolicyInfo info = InfoOf(config);
    info.step = 18;
    info.success_rate = 0.5;
    info.mean_return = -12.5;
    const fs::path file = corpus / "policy/accepted" / ("dueling-" + physics + ".safetensors");
    SaveTensors(training.agent().ExportPolicy(info)->ToTensors(), file);
  }
  // The other kind of network, as short as can be.
  const Plant plant;
  const QNetworkShape shape{kObservationSize, 2, {1}, 0, false, false};
  const QNetwork<float> network(shape);
  const PolicyInfo all = InfoOf(Config());
  PolicyInfo info;
  info.plant = all.plant;
  info.control_period = all.control_period;
  info.observation = all.observation;
  const QPolicy policy(shape, std::vector<float>(network.num_parameters(), 0.25F), {-1, 1}, info);
  SaveTensors(policy.ToTensors(), corpus / "policy/accepted/plain-of-another-writer.safetensors");
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
