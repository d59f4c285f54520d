#pragma once

#include <cstdint>
#include <optional>

#include "core/env.h"

namespace upswing {

/// Environments of which each one can be begun anew at any moment, as Gymnasium's reset asks for.
class SeededEnv : public VectorEnv {
 public:
  /// Begins another episode of an environment. With a seed, this episode and those that follow are
  /// the ones that a first environment of a new set with this seed would have.
  virtual void Restart(int env, std::optional<uint64_t> seed) = 0;

  /// Lets the next Step leave an environment as it is: its successor is the present observation,
  /// all else of its result 0.
  virtual void Hold(int env) = 0;
};

}  // namespace upswing
