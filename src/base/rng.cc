#include "base/rng.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <span>

namespace upswing {
namespace {

uint64_t SplitMix64(uint64_t& x) {
  uint64_t z = (x += 0x9e3779b97f4a7c15);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

}  // namespace

Rng::Rng(uint64_t seed, std::string_view stream, uint64_t index) : state_{} {
  // Absorb seed, name and index one after the other; SplitMix64 mixes each into all bits.
  uint64_t x = seed;
  uint64_t absorbed = SplitMix64(x);
  for (const char c : stream) {
    x = absorbed ^ static_cast<unsigned char>(c);
    absorbed = SplitMix64(x);
  }
  x = absorbed ^ index;
  for (uint64_t& word : state_) word = SplitMix64(x);
}

uint64_t Rng::Next() {
  auto& s = state_;
  const uint64_t result = std::rotl(s[0] + s[3], 23) + s[0];
  const uint64_t t = s[1] << 17;
  s[2] ^= s[0];
  s[3] ^= s[1];
  s[1] ^= s[2];
  s[0] ^= s[3];
  s[2] ^= t;
  s[3] = std::rotl(s[3], 45);
  return result;
}

double Rng::Uniform() { return static_cast<double>(Next() >> 11) * 0x1p-53; }

uint64_t Rng::Below(uint64_t n) {
  // The high word of a 64×64-bit product is uniform after the rejection of the few low words that
  // favour some results.
  __extension__ using uint128 = unsigned __int128;
  uint128 product = uint128{Next()} * n;
  if (static_cast<uint64_t>(product) < n) {
    const uint64_t threshold = -n % n;
    while (static_cast<uint64_t>(product) < threshold) product = uint128{Next()} * n;
  }
  return static_cast<uint64_t>(product >> 64);
}

double Rng::Normal() {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform()));  // 1 - u is never 0
  return radius * std::cos(2.0 * std::numbers::pi * Uniform());
}

std::array<double, 2> Rng::NormalPair() {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform()));
  const double angle = 2.0 * std::numbers::pi * Uniform();
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

void Rng::State(const Archive& archive) {
  archive.Array("state", std::span<uint64_t>(state_), kAnyNumber<uint64_t>);
  const bool lives = std::ranges::any_of(state_, [](uint64_t word) { return word != 0; });
  archive.Check(lives, "state", "a number above 0, as a state of zeros generates only zeros");
}

}  // namespace upswing
