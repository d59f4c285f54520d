#include "rl/ppo/normalizer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/rng.h"
#include "base/testing.h"

namespace upswing {
namespace {

std::vector<float> RandomRows(int rows) {
  Rng rng(1, "observations");
  std::vector<float> values;
  for (int i = 0; i < rows; ++i) {
    values.push_back(static_cast<float>(100 + 0.5 * rng.Normal()));
    values.push_back(static_cast<float>(-2 + 7 * rng.Normal()));
  }
  return values;
}

TEST(Normalizer, StatisticsAreThoseOfAllRowsHoweverTheyCome) {
  const std::vector<float> values = RandomRows(1000);
  Normalizer normalizer(2);
  for (int first = 0, count = 1; first < 1000; first += count, count = std::min(37, 1000 - first)) {
    normalizer.Add({values.data() + 2 * first, count, 2});
  }
  for (size_t k = 0; k < 2; ++k) {
    double mean = 0, variance = 0;
    for (size_t i = 0; i < 1000; ++i) mean += values[2 * i + k] / 1000.0;
    for (size_t i = 0; i < 1000; ++i) variance += std::pow(values[2 * i + k] - mean, 2) / 1000;
    EXPECT_NEAR(normalizer.mean()[k], mean, 1e-10);
    EXPECT_NEAR(normalizer.deviation()[k], std::sqrt(variance), 1e-10);
  }
  std::vector<float> normal(2);
  normalizer.Apply(std::span(values).first(2), normal);
  EXPECT_NEAR(normal[0], (values[0] - normalizer.mean()[0]) / normalizer.deviation()[0], 1e-4);
}

TEST(Normalizer, ChangesNothingAtFirstAndDoesNotBlowUpAConstant) {
  Normalizer normalizer(1);
  std::vector<float> obs{3}, normal(1);
  normalizer.Apply(obs, normal);
  EXPECT_EQ(normal[0], 3);
  const std::vector<float> constant{2, 2, 2};
  normalizer.Add({constant.data(), 3, 1});
  normalizer.Apply(obs, normal);
  EXPECT_NEAR(normal[0], 100, 1e-3);  // 1 divided by the least deviation
}

TEST(Normalizer, LoadedStatisticsAreTheSaved) {
  const std::vector<float> values = RandomRows(50);
  Normalizer saved(2), loaded(2);
  saved.Add({values.data(), 50, 2});
  SaveAndLoad([&](const Archive& a) { saved.State(a); },
              [&](const Archive& a) { loaded.State(a); });
  std::vector<float> a(2), b(2);
  saved.Add({values.data(), 20, 2});
  loaded.Add({values.data(), 20, 2});
  saved.Apply(std::span(values).first(2), a);
  loaded.Apply(std::span(values).first(2), b);
  EXPECT_EQ(a, b);
}

}  // namespace
}  // namespace upswing
