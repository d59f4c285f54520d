#include "report/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/file.h"
#include "core/rng.h"

namespace upswing {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

void ExpectSame(const Estimate& got, const nlohmann::json& expected, const char* what) {
  SCOPED_TRACE(what);
  const auto value = expected["value"].get<double>();
  EXPECT_NEAR(got.value, value, 1e-12 * std::max(1.0, std::abs(value)));
  // An end over R resamples has a standard deviation of about s / √R. The file has the mean of five
  // bootstraps of 2,000, and how far the farthest of them is from it, which is typically 1.2 s /
  // √2000. Our own 10,000 differ from that mean by √2 s / √10000 or half that distance; four times
  // as much, which is 4 standard deviations, is none of chance.
  const auto tolerance = 2 * expected["spread"].get<double>() + 1e-9;
  ASSERT_TRUE(got.interval);
  EXPECT_NEAR(got.interval->low, expected["interval"][0].get<double>(), tolerance);
  EXPECT_NEAR(got.interval->high, expected["interval"][1].get<double>(), tolerance);
}

TEST(Statistics, AgreeWithRliable) {
  const auto folder = std::filesystem::path(__FILE__).parent_path();
  const auto file = nlohmann::json::parse(ReadTextFile(folder / "testdata/rliable.json"));
  ASSERT_EQ(file["cases"].size(), 4U);
  for (const auto& c : file["cases"]) {
    const auto x = c["x"].get<Strata>();
    const auto y = c["y"].get<Strata>();
    SCOPED_TRACE(c["iqm"].dump());
    ExpectSame(EstimateIqm(x), c["iqm"], "IQM");
    ExpectSame(EstimateIqmDifference(x, y), c["difference"], "difference of IQMs");
    ExpectSame(EstimateImprovement(x, y), c["improvement"], "probability of improvement");
  }
}

TEST(Statistics, InterquartileMeanByHand) {
  EXPECT_EQ(InterquartileMean({7}), 7);
  EXPECT_EQ(InterquartileMean({1, 2, 9}), 4);           // floor(3/4) = 0 cut
  EXPECT_EQ(InterquartileMean({100, 1, 2, 6}), 4);      // one at each end
  EXPECT_EQ(InterquartileMean({-50, 1, 2, 6, 90}), 3);  // still one
  EXPECT_EQ(InterquartileMean({kInf, 1, 2, 6}), 4);
  EXPECT_EQ(InterquartileMean({kInf, kInf, 2, 6}), kInf);
}

TEST(Statistics, ProbabilityOfImprovementByHand) {
  const std::vector<double> x{1, 3, 3}, y{2, 3};
  EXPECT_DOUBLE_EQ(ProbabilityOfImprovement(x, y), (0 + 0 + 1 + 0.5 + 1 + 0.5) / 6);
  EXPECT_DOUBLE_EQ(ProbabilityOfImprovement(x, y) + ProbabilityOfImprovement(y, x), 1);
  // Two runs that never solve the task are as good as each other, and worse than one that does.
  const std::vector<double> never{-kInf, -kInf}, once{-kInf, -20};
  EXPECT_EQ(ProbabilityOfImprovement(never, never), 0.5);
  EXPECT_EQ(ProbabilityOfImprovement(once, never), 0.75);
}

TEST(Statistics, AnIntervalDependsOnTheScoresAlone) {
  const auto a = EstimateIqm({{3, 1, 4, 1, 5}}), b = EstimateIqm({{1, 1, 3, 4, 5}});
  EXPECT_EQ(a.interval->low, b.interval->low);
  EXPECT_EQ(a.interval->high, b.interval->high);
  EXPECT_LT(a.interval->low, a.value);
  EXPECT_GT(a.interval->high, a.value);
  EXPECT_FALSE(EstimateIqm({{1}}).interval);
  EXPECT_FALSE(EstimateImprovement({{1, 2}}, {{1}}).interval);
  EXPECT_EQ(EstimateIqm({{2, 2, 2}}).interval->high, 2);
}

TEST(Statistics, EachStratumIsResampledOnItsOwn) {
  // Without strata a resample would hold other shares of the two tasks, and the mean would move.
  const auto mean = [](const Strata& s) { return (s[0][0] + s[0][1] + s[1][0] + s[1][1]) / 4; };
  const auto interval = BootstrapInterval({{1, 1}, {5, 5}}, mean);
  EXPECT_EQ(interval->low, 3);
  EXPECT_EQ(interval->high, 3);
}

TEST(Statistics, AnIntervalOfRunsThatNeverSolvedReachesInfinity) {
  const Estimate some = EstimateIqm({{10, 11, 12, 13, kInf}});
  EXPECT_EQ(some.value, 12);
  EXPECT_LT(some.interval->low, 12);
  EXPECT_EQ(some.interval->high, kInf);
}

/// Share of the samples of `runs` normal numbers whose interval for the IQM holds the true one, 0.
double Coverage(size_t runs) {
  constexpr int kSamples = 1000;
  int held = 0;
  Rng rng(1, "coverage", runs);
  for (int i = 0; i < kSamples; ++i) {
    std::vector<double> sample(runs);
    for (double& x : sample) x = rng.Normal();
    const auto interval = EstimateIqm({sample}, 500).interval;
    held += interval->low <= 0 && interval->high >= 0 ? 1 : 0;
  }
  return static_cast<double>(held) / kSamples;
}

TEST(Statistics, IntervalsOfFewRunsAreTooNarrowAndOfManyRight) {
  // 1,000 samples tell the coverage to ±0.01 (one standard deviation at 0.85). docs/statistics.md
  // has these figures.
  const double five = Coverage(5), ten = Coverage(10), thirty = Coverage(30);
  RecordProperty("five", std::to_string(five));
  RecordProperty("ten", std::to_string(ten));
  RecordProperty("thirty", std::to_string(thirty));
  EXPECT_NEAR(five, 0.906, 0.03);
  EXPECT_LT(five, ten);
  EXPECT_NEAR(thirty, 0.95, 0.03);
}

}  // namespace
}  // namespace upswing
