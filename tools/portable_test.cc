// A training by the portable layers alone (core, nn, sim, rl, control): in memory, in the closed
// form, its checkpoint through the safetensors format. Linked with all of these libraries and
// nothing else of ours; portable_test.py checks what it asks the system for.
#include <algorithm>
#include <cstdio>
#include <vector>

#include "core/error.h"
#include "core/safetensors.h"
#include "core/thread_pool.h"
#include "rl/dqn.h"
#include "rl/evaluate.h"
#include "rl/trainer.h"
#include "sim/pendulum_env.h"

namespace upswing {
namespace {

PendulumEnvConfig Environments(int count, uint64_t seed, ThreadPool& pool) {
  PendulumEnvConfig config;
  config.engine = &kClosedForm;
  config.num_envs = count;
  config.seed = seed;
  config.pool = &pool;
  return config;
}

TrainConfig TrainSettings() {
  TrainConfig config;
  config.envs = 8;
  config.steps = 4000;
  config.eval_every = 2000;
  return config;
}

DqnConfig AgentSettings() {
  DqnConfig config;
  config.hidden = {16, 16};
  config.head = 8;
  config.learning_starts = 200;
  return config;
}

/// A small training of two threads.
class SmallTraining {
 public:
  Trainer& trainer() { return trainer_; }
  int64_t updates() const { return agent_.updates(); }

  std::vector<std::byte> Checkpoint() {
    Tensors tensors;
    trainer_.State(Archive::Saver(tensors));
    return WriteSafetensors(tensors).Joined();
  }
  void Load(std::vector<std::byte> bytes) {
    const Tensors tensors = ReadSafetensors(std::move(bytes), "the checkpoint in memory");
    trainer_.State(Archive::Loader(tensors));
  }

 private:
  Evaluation Judge(const Policy& policy, int64_t step) {
    PendulumEnv env(Environments(4, static_cast<uint64_t>(step), pool_));
    return Evaluate(policy, env, &pool_);
  }

  ThreadPool pool_{2};
  PendulumEnv env_{Environments(8, 1, pool_)};
  Dqn agent_{AgentSettings(), env_.spec(), 1, pool_};
  Trainer trainer_{{TrainSettings(),
                    [this](const Policy& policy, int64_t step) { return Judge(policy, step); },
                    {},
                    {}},
                   agent_,
                   env_};
};

/// Whether two checkpoints have the same tensors, but for the time that the trainings took.
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

/// A training that is saved half-way and loaded into another goes on as if it had not been.
void CheckThatItResumes() {
  SmallTraining whole, resumed;
  while (whole.trainer().state().steps < 2000) whole.trainer().Step();
  const std::vector<std::byte> half = whole.Checkpoint();
  resumed.Load(half);
  while (whole.trainer().Step()) continue;
  while (resumed.trainer().Step()) continue;
  const Tensors end = ReadSafetensors(whole.Checkpoint(), "whole");
  if (!Same(end, ReadSafetensors(resumed.Checkpoint(), "resumed"))) {
    throw Failure("resumed: expected the checkpoint of a training that was not stopped");
  }
  if (Same(end, ReadSafetensors(half, "half"))) throw Failure("the training changed nothing");
  std::printf("%d updates in %d steps, resumed at 2000 to the same bits\n",
              static_cast<int>(whole.updates()), static_cast<int>(whole.trainer().state().steps));
}

}  // namespace
}  // namespace upswing

int main() try { upswing::CheckThatItResumes(); } catch (const upswing::Error& error) {
  std::printf("%s\n", error.what());
  return error.exit_code();
}
