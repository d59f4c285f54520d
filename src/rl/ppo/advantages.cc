#include "rl/ppo/advantages.h"

#include <cmath>

namespace upswing {
namespace {

/// Mean and population variance of n numbers.
struct Spread {
  double mean, variance;
};
template <typename F>
Spread SpreadOf(size_t n, const F& number) {
  double sum = 0, squares = 0;
  for (size_t i = 0; i < n; ++i) sum += number(i);
  const double mean = sum / static_cast<double>(n);
  for (size_t i = 0; i < n; ++i) squares += (number(i) - mean) * (number(i) - mean);
  return {mean, squares / static_cast<double>(n)};
}

}  // namespace

void GeneralizedAdvantages(const AdvantageInputs& in, double gamma, double lambda,
                           Matrix<float> advantage) {
  const int T = advantage.rows();
  const int N = advantage.cols();
  const auto discount = static_cast<float>(gamma);
  const auto decay = static_cast<float>(gamma * lambda);
  for (int t = T - 1; t >= 0; --t) {
    for (int i = 0; i < N; ++i) {
      const float future = in.terminated(t, i) != 0 ? 0 : discount * in.next_value(t, i);
      const bool goes_on = t + 1 < T && in.terminated(t, i) == 0 && in.truncated(t, i) == 0;
      const float delta = in.reward(t, i) + future - in.value(t, i);
      advantage(t, i) = delta + (goes_on ? decay * advantage(t + 1, i) : 0);
    }
  }
}

void Standardize(std::span<float> values) {
  constexpr double kLeast = 1e-8;  // smallest standard deviation
  const auto [mean, variance] = SpreadOf(values.size(), [&](size_t i) { return values[i]; });
  const double scale = 1 / (std::sqrt(variance) + kLeast);
  for (float& x : values) x = static_cast<float>((x - mean) * scale);
}

double ExplainedVariance(std::span<const float> target, std::span<const float> prediction) {
  const double all = SpreadOf(target.size(), [&](size_t i) { return target[i]; }).variance;
  if (all == 0) return 0;
  const auto rest = [&](size_t i) { return double{target[i]} - prediction[i]; };
  return 1 - SpreadOf(target.size(), rest).variance / all;
}

}  // namespace upswing
