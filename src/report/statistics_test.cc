#include "report/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/rng.h"
#include "os/file.h"

namespace upswing {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void ExpectSame(const Estimate& got, const nlohmann::json& expected, const char* what) {
  SCOPED_TRACE(what);
  const auto value = expected["value"].get<double>();
  EXPECT_NEAR(got.value, value, 1e-12 * std::max(1.0, std::abs(value)));
  // The end of an interval over R resamples has a standard deviation of about s / √R. The file has
  // the mean of five bootstraps of 2,000 resamples, and the largest distance of a bootstrap from
  // that mean, typically 1.2 s / √2000.
  //
  // Our own 10,000 resamples differ from that mean by √2 s / √10000, which is half that distance.
  // The tolerance is four times as much, 4 standard deviations, so that chance does not exceed it.
  const auto tolerance = 2 * expected["spread"].get<double>() + 1e-9;
  ASSERT_TRUE(got.interval);
  EXPECT_NEAR(got.interval->low, expected["interval"][0].get<double>(), tolerance);
  EXPECT_NEAR(got.interval->high, expected["interval"][1].get<double>(), tolerance);
}

TEST(Statistics, AgreeWithRliable) {
  const auto folder = std::filesystem::path(__FILE__).parent_path();
  const auto file = nlohmann::json::parse(ReadOwnFile(folder / "testdata/rliable.json"));
  ASSERT_EQ(file["cases"].size(), 4U);
  for (const auto& c : file["cases"]) {
    if (c["x"].size() > 1) continue;  // scores of several tasks, which we do not have
    const auto x = c["x"][0].get<std::vector<double>>();
    const auto y = c["y"][0].get<std::vector<double>>();
    SCOPED_TRACE(c["iqm"].dump());
    ExpectSame(EstimateIqm(x), c["iqm"], "IQM");
    ExpectSame(EstimateIqmDifference(x, y), c["difference"], "difference of IQMs");
    ExpectSame(EstimateImprovement(x, y), c["improvement"], "probability of improvement");
  }
}

TEST(Statistics, InterquartileMeanByHand) {
  EXPECT_EQ(InterquartileMean({7}), 7);
  EXPECT_EQ(InterquartileMean({1, 2, 9}), 4);           // floor(3/4) = 0 values cut
  EXPECT_EQ(InterquartileMean({100, 1, 2, 6}), 4);      // one value cut at each end
  EXPECT_EQ(InterquartileMean({-50, 1, 2, 6, 90}), 3);  // still one value cut at each end
  EXPECT_EQ(InterquartileMean({kInfinity, 1, 2, 6}), 4);
  EXPECT_EQ(InterquartileMean({kInfinity, kInfinity, 2, 6}), kInfinity);
}

TEST(Statistics, PairedDifferenceByHand) {
  // Three differences are 1 and one is 5. A resample's mean is 1 plus the number of times that it
  // has the 5: 1 to 5 with the binomial probabilities 0.316, 0.422, 0.211, 0.047 and 0.004. Their
  // sums up to 3 and 4 are 0.949 and 0.996, far from 0.975, which therefore lies at 4.
  const std::vector<double> x{101, 13, 6, 5}, y{100, 12, 1, 4};
  const Estimate e = EstimatePairedDifference(x, y);
  EXPECT_DOUBLE_EQ(e.value, 2);
  ASSERT_TRUE(e.interval);
  EXPECT_DOUBLE_EQ(e.interval->low, 1);
  EXPECT_DOUBLE_EQ(e.interval->high, 4);
  // The interval of two unpaired means would be as wide as the episodes differ.
  const std::vector<double> same{101, 13, 2, 5};
  EXPECT_EQ(EstimatePairedDifference(same, y).value, 1);
  EXPECT_FALSE(EstimatePairedDifference(same, y).interval);  // all pairs differ by 1
  EXPECT_FALSE(EstimatePairedDifference({}, {}).interval);
  EXPECT_EQ(EstimatePairedDifference({}, {}).value, 0);
}

TEST(Statistics, ProbabilityOfImprovementByHand) {
  const std::vector<double> x{1, 3, 3}, y{2, 3};
  EXPECT_DOUBLE_EQ(ProbabilityOfImprovement(x, y), (0 + 0 + 1 + 0.5 + 1 + 0.5) / 6);
  EXPECT_DOUBLE_EQ(ProbabilityOfImprovement(x, y) + ProbabilityOfImprovement(y, x), 1);
  // Two runs that never solve the task are equally good, and worse than a run that solves it.
  const std::vector<double> never{-kInfinity, -kInfinity}, once{-kInfinity, -20};
  EXPECT_EQ(ProbabilityOfImprovement(never, never), 0.5);
  EXPECT_EQ(ProbabilityOfImprovement(once, never), 0.75);
}

TEST(Statistics, AnIntervalDependsOnlyOnTheScores) {
  const auto a = EstimateIqm({3, 1, 4, 1, 5}), b = EstimateIqm({1, 1, 3, 4, 5});
  EXPECT_EQ(a.interval->low, b.interval->low);
  EXPECT_EQ(a.interval->high, b.interval->high);
  EXPECT_LT(a.interval->low, a.value);
  EXPECT_GT(a.interval->high, a.value);
  EXPECT_FALSE(EstimateIqm({1}).interval);
  EXPECT_FALSE(EstimateImprovement({1, 2}, {1}).interval);
  EXPECT_FALSE(EstimateIqm({2, 2, 2}).interval);  // no interval without a width
}

TEST(Statistics, EachStratumIsResampledOnItsOwn) {
  // Without strata, a resample could hold other shares of the two tasks, and the mean would change.
  const auto mean = [](const Strata& s) { return (s[0][0] + s[0][1] + s[1][0] + s[1][1]) / 4; };
  const auto interval = BootstrapInterval({{0, 2}, {5, 5}}, mean);
  EXPECT_EQ(interval->low, 2.5);
  EXPECT_EQ(interval->high, 3.5);
}

TEST(Statistics, AProbabilityHasAnIntervalWhereAllPairsAgreeToo) {
  const Estimate all = EstimateImprovement({6, 7, 8, 9, 10}, {1, 2, 3, 4, 5});
  EXPECT_EQ(all.value, 1);
  ASSERT_TRUE(all.interval);
  EXPECT_EQ(all.interval->high, 1);
  const double p = all.interval->low;
  // At the end of the interval, the estimate is 1.96 standard deviations away.
  const double variance = p * (1 - p) * (1 + 4 * ((1 - p) / (2 - p) + p / (1 + p))) / 25;
  EXPECT_NEAR(1 - p, 1.959963984540054 * std::sqrt(variance), 1e-12);
  EXPECT_NEAR(p, 0.643, 0.001);
  const Estimate none = EstimateImprovement({1, 2, 3, 4, 5}, {6, 7, 8, 9, 10});
  EXPECT_EQ(none.interval->low, 0);
  EXPECT_NEAR(none.interval->high, 1 - p, 1e-12);
  // Runs that never solve the task say little about which agent would be faster.
  const Estimate ties = EstimateImprovement({-kInfinity, -kInfinity, -kInfinity},
                                            {-kInfinity, -kInfinity, -kInfinity});
  EXPECT_NEAR(ties.interval->low, 0.153, 0.001);
  EXPECT_NEAR(ties.interval->high, 0.847, 0.001);
}

TEST(Statistics, TheScoreIntervalOfAProbabilityHoldsItInAbout95PercentOfCases) {
  // Normal scores x = y + √2 Φ⁻¹(p). 2,000 samples give the coverage to ±0.005.
  const double shifts[] = {0, 0.7416143, 1.1902334, 2.3261744};  // p = 0.5, 0.7, 0.8, 0.95
  const double ps[] = {0.5, 0.7, 0.8, 0.95};
  Rng rng(1, "coverage of the score interval");
  for (const size_t runs : {5UL, 10UL}) {
    for (int k = 0; k < 4; ++k) {
      int held = 0;
      for (int i = 0; i < 2000; ++i) {
        std::vector<double> x(runs), y(runs);
        for (double& score : x) score = rng.Normal() + shifts[k];
        for (double& score : y) score = rng.Normal();
        const double estimate = ProbabilityOfImprovement(x, y);
        const Interval interval = ImprovementScoreInterval(estimate, runs, runs);
        held += interval.low <= ps[k] && ps[k] <= interval.high ? 1 : 0;
      }
      EXPECT_NEAR(held / 2000.0, 0.955, 0.025) << runs << " runs, p = " << ps[k];
    }
  }
}

TEST(Statistics, AnIntervalOfRunsThatNeverSolvedReachesInfinity) {
  const Estimate some = EstimateIqm({10, 11, 12, 13, kInfinity});
  EXPECT_EQ(some.value, 12);
  EXPECT_LT(some.interval->low, 12);
  EXPECT_EQ(some.interval->high, kInfinity);
}

/// Share of samples, of `runs` normal numbers each, whose IQM interval contains the true IQM of 0.
double Coverage(size_t runs) {
  constexpr int kSamples = 1000;
  int held = 0;
  Rng rng(1, "coverage", runs);
  for (int i = 0; i < kSamples; ++i) {
    std::vector<double> sample(runs);
    for (double& x : sample) x = rng.Normal();
    const auto interval = EstimateIqm(sample, 500).interval;
    held += interval->low <= 0 && interval->high >= 0 ? 1 : 0;
  }
  return static_cast<double>(held) / kSamples;
}

TEST(Statistics, IntervalsOfFewRunsAreTooNarrowAndOfManyRight) {
  // 1,000 samples give the coverage to ±0.01 (one standard deviation at 0.85).
  // docs/results/seeds.md has these coverages.
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
