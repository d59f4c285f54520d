#pragma once

#include <span>
#include <string_view>

#include "base/archive.h"

namespace upswing {

/// Description of an agent's actions: `size` numbers within bounds. A discrete action is one
/// number, the index of the action.
struct ActionSpace {
  int size = 1;  // A
  Bounds<float> bounds{-1, 1};
  bool whole = false;  // whether only integers are allowed

  /// The discrete actions 0 … count - 1.
  static ActionSpace Discrete(size_t count) {
    return {1, {0, static_cast<float>(count - 1)}, true};
  }
  /// Throws BadInput about the tensor `name` unless all `actions` (… × A) are in this space.
  void Check(const Archive& archive, std::string_view name, std::span<const float> actions) const;
};

}  // namespace upswing
