#pragma once

#include <span>
#include <string_view>

namespace upswing {

/// A file of configs/plants/, compiled into the program.
struct ShippedPlant {
  std::string_view name;
  std::string_view toml;
};

/// All plants of configs/plants/, sorted by name.
std::span<const ShippedPlant> EmbeddedPlants();

}  // namespace upswing
