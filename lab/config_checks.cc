#include "lab/config_checks.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "io/machine.h"
#include "lab/format.h"
#include "nn/q_network.h"

namespace upswing {
namespace {

/// Such as `1.5 GB`.
std::string Gigabytes(double bytes) { return fmt::format("{:.1f} GB", 1e-9 * bytes); }

int ObservationSize(const Config& config) { return SpecOf(config.Environments()).obs_size; }

double NumParameters(const Config& config) {
  const QNetwork<float> network(
      config.dqn.Shape(ObservationSize(config), static_cast<int>(config.dqn.levels)));
  return static_cast<double>(network.num_parameters());
}

}  // namespace

std::vector<std::string> Warnings(const Config& config) {
  const DqnConfig& d = config.dqn;
  std::vector<std::string> warnings;
  // Environments step together: a training ends with the lock-step that reaches its last step.
  const int64_t envs = config.train.envs;
  const int64_t steps = (config.train.steps + envs - 1) / envs * envs;
  if (d.learning_starts >= steps) {
    warnings.push_back(fmt::format(
        "learning starts after step {}, and there are {} steps: nothing will be learned",
        FormatCount(d.learning_starts), FormatCount(steps)));
  }
  if (d.updates_per_step == 0) {
    warnings.emplace_back("updates_per_step is 0: nothing will be learned");
  }
  if (d.learning_rate == 0 && d.learning_rate_end == 0) {
    warnings.emplace_back("learning_rate is 0 to the end: nothing will be learned");
  }
  if (d.tau == 0 && d.target_period == 0) {
    warnings.emplace_back("tau is 0: the target network will stay as it began");
  }
  if (std::ranges::all_of(config.reward.weight, [](double weight) { return weight == 0; })) {
    warnings.emplace_back("every weight of the reward is 0: there is nothing to learn");
  }
  return warnings;
}

TrainingSize SizeOf(const Config& config) {
  // Online, target and kept parameters, gradient, Adam's two moments, and the forms that products
  // want of online and target weights. The checkpoint holds five of these.
  constexpr double kArrays = 8, kSavedArrays = 5;
  constexpr double kFloat = sizeof(float);
  const double parameters = kFloat * NumParameters(config);
  const double row = 2.0 * ObservationSize(config) + 3;  // of a transition
  const double replay = kFloat * row * static_cast<double>(config.dqn.replay);
  const double activations = kFloat * static_cast<double>(config.dqn.batch) *
                             static_cast<double>(*std::ranges::max_element(config.dqn.hidden)) *
                             static_cast<double>(3 * config.dqn.hidden.size());
  const double checkpoint = kSavedArrays * parameters + replay;
  // The first checkpoint, without a replay memory, lies beside what it is loaded into.
  return {kArrays * parameters + activations + std::max(kSavedArrays * parameters, replay),
          checkpoint};
}

void CheckMemory(const Config& config, int64_t runs) {
  const double needed = static_cast<double>(runs) * SizeOf(config).memory;
  const auto available = static_cast<double>(AvailableMemory());
  if (needed <= available) return;
  throw BadInput(fmt::format(
      "train: expected to fit into the {} of memory that are free, but {}network of {} parameters "
      "and a replay memory of {} transitions take up to {} (smaller: --hidden, --replay{})",
      Gigabytes(available),
      runs > 1 ? fmt::format("{} trainings at a time, each with a ", runs) : "a ",
      FormatCount(NumParameters(config)), FormatCount(config.dqn.replay), Gigabytes(needed),
      runs > 1 ? ", --jobs" : ""));
}

}  // namespace upswing
