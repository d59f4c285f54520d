#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "base/archive.h"

namespace upswing {

/// A named stream of random numbers: xoshiro256++ (Blackman and Vigna, 2021). SplitMix64 seeds it
/// from the run's seed, the name of its use, and an index (an environment, an episode). Two uses
/// with different names or indices never share a stream.
class Rng {
 public:
  Rng(uint64_t seed, std::string_view stream, uint64_t index = 0);

  /// 64 random bits.
  uint64_t Next();

  /// Uniform random number in [0, 1) with 53 bits.
  double Uniform();

  /// Uniform random number in [low, high).
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }

  /// Uniform integer in [0, n), without bias (Lemire, 2019). n > 0.
  uint64_t Below(uint64_t n);

  /// Standard normal (Box and Muller, 1958). It uses only the cosine branch, so no value is kept.
  double Normal();
  /// Two independent standard normals. The first is the value that Normal would return.
  std::array<double, 2> NormalPair();

  /// Saves or loads the stream's state.
  void State(const Archive& archive);

 private:
  std::array<uint64_t, 4> state_;
};

}  // namespace upswing
