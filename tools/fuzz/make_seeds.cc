// Writes the corpus inputs that the program itself creates. Run it after a change of the file
// formats:
//   fuzz_seeds tools/fuzz/corpus
#include <cstdio>
#include <filesystem>

#include "agents/loaded_policy.h"
#include "base/error.h"
#include "nn/network_policy.h"
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
  // A minimal example of the other kind of network.
  const Plant plant;
  const PolicyInfo all = InfoOf(Config());
  PolicyInfo info;
  info.plant = all.plant;
  info.control_period = all.control_period;
  info.observation = all.observation;
  for (const ActionRule rule : {ActionRule::kClippedGaussian, ActionRule::kCategorical}) {
    const bool categorical = rule == ActionRule::kCategorical;
    NetworkPolicyParts parts{rule};
    parts.shape = {kObservationSize, {2}, categorical ? 3 : 2, false, Activation::kTanh};
    parts.parameters.assign(categorical ? 27 : 24, 0.25F);
    parts.action_limit = {plant.torque_limit};
    if (categorical) parts.torques = {-1, 0, 1};
    parts.critic = {kObservationSize, {2}, 1, false, Activation::kTanh};
    parts.critic_parameters.assign(21, 0.5F);
    SaveTensors(NetworkPolicy(parts, info).ToTensors(),
                corpus / "policy/accepted" /
                    (categorical ? "categorical.safetensors" : "clipped-gaussian.safetensors"));
  }
  NetworkPolicyParts parts{ActionRule::kLevels, {kObservationSize, {1}, 2}};
  parts.parameters.assign(Network(parts.shape).num_parameters(), 0.25F);
  parts.torques = {-1, 1};
  const NetworkPolicy policy(parts, info);
  SaveTensors(policy.ToTensors(), corpus / "policy/accepted/plain-of-another-writer.safetensors");
  Tensors narrow = policy.Rounded().ToTensors();
  narrow.Narrow();
  SaveTensors(narrow, corpus / "policy/accepted/bfloat16.safetensors");
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
