#include "report/learning_curve.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "report/testing.h"

namespace upswing {
namespace {

double Seconds(const EvaluationRow& row) { return row.seconds; }
double Return(const EvaluationRow& row) { return row.mean_return; }

TEST(LearningCurve, InterpolatesAndKeepsTheLastValue) {
  const RunGroup one{"a", {MadeRun(1, {{0, 10}, {0, 30}, {1, 50}})}};
  const Line line = LearningCurve(one, Seconds, Return, {1, 1.5, 2, 2.75, 3, 9});
  EXPECT_EQ(line.name, "a");
  EXPECT_EQ(line.y, (std::vector<double>{10, 20, 30, 45, 50, 50}));
  EXPECT_TRUE(line.low.empty());  // no interval of one run
}

TEST(LearningCurve, IsTheInterquartileMeanWithItsInterval) {
  RunGroup group{"a", {}};
  for (int64_t seed = 1; seed <= 5; ++seed) {
    group.runs.push_back(MadeRun(seed, {{0, static_cast<double>(seed * seed)}, {0, 7}}));
  }
  const Line line = LearningCurve(group, Seconds, Return, {1, 2});
  EXPECT_EQ(line.y, (std::vector<double>{(4 + 9 + 16) / 3.0, 7}));
  const Interval interval = *EstimateIqm({{1, 4, 9, 16, 25}}, 2000).interval;
  EXPECT_EQ(line.low, (std::vector<double>{interval.low, 7}));
  EXPECT_EQ(line.high, (std::vector<double>{interval.high, 7}));
}

TEST(LearningCurve, TheGridBeginsWhereAllRunsHaveBeenEvaluated) {
  RunRecord late = MadeRun(2, {{0, 0}, {0, 0}});
  late.evaluations.front().seconds = 1.5;
  const RunGroup group{"a", {MadeRun(1, {{0, 0}, {0, 0}}), late}};
  const auto grid = CurveGrid(group, Seconds, 4);
  ASSERT_GT(grid.size(), 100U);
  EXPECT_EQ(grid.front(), 1.5);
  EXPECT_EQ(grid.back(), 4);
  EXPECT_TRUE(std::ranges::is_sorted(grid));
  EXPECT_EQ(CurveGrid(group, Seconds, 1.5), std::vector<double>{1.5});
}

TEST(LearningCurve, TheFigureSaysWhereValuesAreKept) {
  const RunGroup a{"a", {MadeRun(1, {{0, 0}, {0, 1}}), MadeRun(2, {{0, 0}, {0, 1}})}};
  const RunGroup b{"b", {MadeRun(1, {{0, 0}, {0, 1}, {0, 2}})}};
  const Figure even = LearningCurves({a}), uneven = LearningCurves({a, b});
  EXPECT_EQ(even.title.find("keeps"), std::string::npos);
  EXPECT_NE(uneven.title.find("keeps its last value"), std::string::npos);
  ASSERT_EQ(uneven.panels.size(), 4U);
  for (const Panel& panel : uneven.panels) EXPECT_EQ(panel.lines.size(), 2U);
  EXPECT_EQ(uneven.panels[0].lines[1].name, "");  // one legend for all
  EXPECT_EQ(uneven.panels[1].lines[1].name, "b");
}

}  // namespace
}  // namespace upswing
