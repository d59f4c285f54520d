#include <algorithm>

#include "core/error.h"
#include "core/safetensors.h"
#include "core/text.h"
#include "export/export.h"
#include "io/machine.h"
#include "nn/network_policy.h"
#include "run/this_host.h"
#include "setup/config.h"
#include "setup/training.h"

namespace upswing {
namespace {

/// The policy as it stands, as a small file.
std::vector<std::byte> SmallFile(const Training& training, const std::string& where) {
  const std::unique_ptr<Policy> policy = training.policy();
  const auto* q = dynamic_cast<const NetworkPolicy*>(policy.get());
  if (q == nullptr || q->is_actor()) {
    throw BadInput(Concat(where, ": --checkpoints: expected a Q-network, got ", policy->kind()));
  }
  Tensors file = q->Rounded().ToTensors();
  file.Narrow();
  return WriteSafetensors(file).Joined();
}

/// Whether two policies compute the same.
bool SameTensors(const Policy& a, const Policy& b) {
  const Tensors first = a.ToTensors(), second = b.ToTensors();
  return std::ranges::equal(first.all(), second.all(), [](const auto& one, const auto& other) {
    return one.first == other.first && std::ranges::equal(one.second.bytes, other.second.bytes);
  });
}

}  // namespace

std::vector<Checkpoint> CheckpointsOf(const LoadedPolicy& loaded, int64_t count) {
  const std::string where = loaded.path;
  const PolicyInfo& info = loaded.policy->info();
  const int64_t end = info.step.value_or(0);
  Config config = ConfigIn(info.config, Concat(where, ": metadata \"config\""));
  config.train.steps = std::max<int64_t>(1, end);
  Training training(config, ThisHost(ResolveThreads(0)));

  // All of them: how many there will be is known at the end.
  std::vector<Checkpoint> all{{0, SmallFile(training, where)}};
  while (training.state().steps < end && training.Step()) {
    if (training.state().steps < end && training.trainer().IsDue(config.train.eval_every)) {
      all.push_back({training.state().steps, SmallFile(training, where)});
    }
  }
  if (!SameTensors(*training.policy(), *loaded.policy)) {
    throw BadInput(Concat(where,
                          ": --checkpoints: the training with its settings comes to another policy "
                          "here: expected a file of this version, and of a processor with the same "
                          "vector instructions"));
  }
  const auto most = static_cast<int64_t>(all.size());
  if (count - 1 > most) {
    throw BadInput(Concat("--checkpoints: expected at most ", most + 1, ", as many as ", where,
                          " has evaluations, and the untrained policy, got ", count));
  }
  std::vector<Checkpoint> chosen;
  for (int64_t i = 0; i < count - 1; ++i) {
    chosen.push_back(std::move(all[static_cast<size_t>(i * most / (count - 1))]));
  }
  return chosen;
}

}  // namespace upswing
