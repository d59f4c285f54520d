#pragma once

#include <span>
#include <string_view>

namespace upswing {

/// A file of configs/, compiled into the program.
struct NamedAgent {
  std::string_view name;
  std::string_view toml;
};

/// All agents of configs/, sorted by name.
std::span<const NamedAgent> EmbeddedAgents();

}  // namespace upswing
