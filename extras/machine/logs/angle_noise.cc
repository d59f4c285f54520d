#include "extras/machine/logs/angle_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace upswing::machine {
namespace {

constexpr int kLeastOrder = 2, kMostOrder = 8;
constexpr double kSame = 1e-12;   // rad, between values that are equal in the file
constexpr double kRepeats = 0.1;  // largest share of changes of 0 of a joint that moves

/// The differences of an order of values `stride` apart, where the joint moves: not all values are
/// equal.
void AddDifferences(const Series& x, int order, int stride, std::vector<double>& differences) {
  const int n = static_cast<int>(x.size());
  std::vector<double> row(order + 1);
  for (int k = 0; k + order * stride < n; ++k) {
    for (int i = 0; i <= order; ++i) row[i] = x[k + i * stride];
    const auto [low, high] = std::ranges::minmax(row);
    if (high - low < kSame) continue;
    for (int left = order; left > 0; --left) {
      for (int i = 0; i < left; ++i) row[i] = row[i + 1] - row[i];
    }
    differences.push_back(std::abs(row.front()));
  }
}

/// The standard deviation of a normal distribution, from the smallest nine tenths of the sizes of
/// its draws. Jumps of the torque are in the rest.
double RobustDeviation(std::vector<double> sizes) {
  // Of the sizes of a normal distribution a tenth is above 1.645; the mean square of the others is
  // 1 - 2 · 1.645 · φ(1.645) / 0.9.
  constexpr double kMeanSquare = 0.6230;
  const auto n = static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(sizes.size()));
  if (n < 1) return std::numeric_limits<double>::infinity();
  std::ranges::nth_element(sizes, sizes.begin() + n);
  double sum = 0;
  for (auto it = sizes.begin(); it != sizes.begin() + n; ++it) sum += *it * *it;
  return std::sqrt(sum / static_cast<double>(n) / kMeanSquare);
}

/// Standard deviation of a difference of independent values with deviation 1: the root of the sum
/// of squared binomial coefficients.
double GainOf(int order) {
  double squares = 0, binomial = 1;
  for (int i = 0; i <= order; ++i) {
    squares += binomial * binomial;
    binomial *= static_cast<double>(order - i) / (i + 1);
  }
  return std::sqrt(squares);
}

}  // namespace

int StrideOf(std::span<const Series> angles, int longest) {
  int stride = 1;
  for (; 2 * stride <= longest; stride *= 2) {
    double moving = 0, repeats = 0;
    for (const Series& x : angles) {
      // A joint that rests for ten strides does not count.
      for (size_t k = 0; k + 10 * stride < x.size(); ++k) {
        const auto piece = std::span(x).subspan(k, 10 * stride + 1);
        if (std::abs(piece.back() - piece.front()) < kSame) continue;
        ++moving;
        if (std::abs(piece[stride] - piece[0]) < kSame) ++repeats;
      }
    }
    if (repeats <= kRepeats * moving) break;
  }
  return stride;
}

double NoiseOf(std::span<const Series> values, int stride) {
  double least = std::numeric_limits<double>::infinity();
  for (int order = kLeastOrder; order <= kMostOrder; ++order) {
    std::vector<double> differences;
    for (const Series& x : values) AddDifferences(x, order, stride, differences);
    least = std::min(least, RobustDeviation(std::move(differences)) / GainOf(order));
  }
  return std::isfinite(least) ? least : 0;
}

double AngleNoise(std::span<const MachineLog> pieces, int joint) {
  constexpr int kLongest = 64;
  std::vector<Series> angles;
  for (const MachineLog& log : pieces) {
    Series& own = angles.emplace_back();
    for (const Joints& q : log.angle) own.push_back(q[joint]);
  }
  return NoiseOf(angles, StrideOf(angles, kLongest));
}

double StepOfNoise(double noise) { return std::sqrt(12) * noise; }

}  // namespace upswing::machine
