#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "agents/config.h"

namespace upswing {

/// A learning algorithm: its name, its settings in a configuration, and its agent.
struct Algorithm {
  std::string name;
  /// The settings in `config`.
  AgentConfig& (*settings)(Config& config);
  const AgentConfig& (*settings_of_const)(const Config& config);
  /// Makes an agent with the settings of `config` for environments of this kind. The threads of the
  /// pool share its work.
  std::unique_ptr<Agent> (*make)(const Config& config, const EnvSpec& spec, uint64_t seed,
                                 ThreadPool& pool);
};

/// All learning algorithms; the first is the default.
std::span<const Algorithm> Algorithms();

/// The algorithm that the configuration names. The default for an unknown name, which
/// CheckAlgorithm in config_layers.cc refuses.
const Algorithm& AlgorithmOf(const Config& config);

}  // namespace upswing
