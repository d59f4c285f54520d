#pragma once

#include <span>
#include <string_view>

namespace upswing {

/// A file of settings, compiled into the program.
struct NamedAgent {
  std::string_view name;
  std::string_view toml;
};

/// All agents of configs/, sorted by name.
std::span<const NamedAgent> EmbeddedAgents();

/// The files of configs/gymnasium, one for each algorithm, by its name: defaults of trainings on a
/// foreign task, over the network and the learning of the named agent, which are tuned for the
/// double pendulum.
std::span<const NamedAgent> GymnasiumDefaults();

}  // namespace upswing
