#include "agents/algorithms.h"

#include <algorithm>
#include <array>

#include "rl/dqn/dqn.h"
#include "rl/ppo/ppo.h"
#include "rl/sac/sac.h"

namespace upswing {
namespace {

/// The row of an algorithm: its settings are `config.*kSettings`, its agent is an AgentType.
template <auto kSettings, typename AgentType>
Algorithm Entry(std::string name) {
  return {
      .name = std::move(name),
      .settings = [](Config& config) -> AgentConfig& { return config.*kSettings; },
      .settings_of_const = [](const Config& config) -> const AgentConfig& {
        return config.*kSettings;
      },
      .make = [](const Config& config, const EnvSpec& spec, uint64_t seed,
                 ThreadPool& pool) -> std::unique_ptr<Agent> {
        return std::make_unique<AgentType>(config.*kSettings, spec, seed, pool);
      },
  };
}

}  // namespace

std::span<const Algorithm> Algorithms() {
  static const std::array kAlgorithms{
      Entry<&Config::dqn, Dqn>("dqn"),
      Entry<&Config::sac, Sac>("sac"),
      Entry<&Config::ppo, Ppo>("ppo"),
  };
  return kAlgorithms;
}

const Algorithm& AlgorithmOf(const Config& config) {
  const auto algorithms = Algorithms();
  const auto found = std::ranges::find(algorithms, config.algorithm, &Algorithm::name);
  return found == algorithms.end() ? algorithms.front() : *found;
}

}  // namespace upswing
