#include "runs/learning_curve.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "runs/testing.h"

namespace upswing {
namespace {

double Seconds(const EvaluationRow& row) { return row.seconds; }
double Return(const EvaluationRow& row) { return row.mean_return; }

TEST(LearningCurve, InterpolatesAndKeepsTheLastValue) {
  const RunGroup one{"a", {MadeRun(1, {{0, 10}, {0, 30}, {1, 50}})}};
  const Line line = LearningCurve(one, Seconds, Return, {1, 1.5, 2, 2.75, 3, 9});
  EXPECT_EQ(line.name, "a");
  EXPECT_EQ(line.y, (std::vector<double>{10, 20, 30, 45, 50, 50}));
  EXPECT_TRUE(line.low.empty());  // one run has no interval
}

TEST(LearningCurve, IsTheInterquartileMeanWithItsInterval) {
  RunGroup group{"a", {}};
  for (int64_t seed = 1; seed <= 5; ++seed) {
    group.runs.push_back(MadeRun(seed, {{0, static_cast<double>(seed * seed)}, {0, 7}}));
  }
  const Line line = LearningCurve(group, Seconds, Return, {1, 2});
  EXPECT_EQ(line.y, (std::vector<double>{(4 + 9 + 16) / 3.0, 7}));
  const Interval interval = *EstimateIqm({1, 4, 9, 16, 25}, 2000).interval;
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

TEST(LearningCurve, CurvesAreDottedFromWhereARunHasEndedOverStepsAndOverTime) {
  const RunGroup a{"a", {MadeRun(1, {{0, 0}, {0, 1}}), MadeRun(2, {{0, 0}, {0, 1}})}};
  const RunGroup b{"b", {MadeRun(1, {{0, 0}, {0, 1}, {0, 2}})}};
  const Figure even = LearningCurves({a}), uneven = LearningCurves({a, b});
  EXPECT_EQ(even.caption.find("keeps"), std::string::npos);
  EXPECT_NE(uneven.caption.find("keeps its last value"), std::string::npos);
  ASSERT_EQ(uneven.panels.size(), 4U);
  for (const Panel& panel : even.panels) EXPECT_FALSE(panel.lines[0].dotted_from);
  for (const Panel& panel : uneven.panels) {
    ASSERT_EQ(panel.lines.size(), 2U);
    ASSERT_TRUE(panel.lines[0].dotted_from);
    EXPECT_FALSE(panel.lines[1].dotted_from);
    const double end = panel.x_label == "steps" ? 2000 : 2;
    EXPECT_GE(*panel.lines[0].dotted_from, end);
    EXPECT_LT(*panel.lines[0].dotted_from, 1.01 * end);
  }
  // Two runs with equal steps end at different times.
  RunGroup slow = a;
  slow.runs[1].evaluations.back().seconds = 8;
  const Figure apart = LearningCurves({slow});
  EXPECT_FALSE(apart.panels[0].lines[0].dotted_from);
  EXPECT_TRUE(apart.panels[1].lines[0].dotted_from);
  EXPECT_NE(apart.caption.find("Dotted"), std::string::npos);
}

TEST(LearningCurve, TheFigureExplainsTheNumberOfRunsAndTheBand) {
  const RunGroup a{"a", {MadeRun(1, {{0, 5}, {0, 10}}), MadeRun(2, {{0, 5}, {0, 10}})}};
  const Figure figure = LearningCurves({a});
  EXPECT_EQ(figure.panels[0].lines[0].name, "");  // one legend for all
  EXPECT_EQ(figure.panels[1].lines[0].name, "a (n = 2)");
  EXPECT_NE(figure.caption.find("pointwise 95% bootstrap interval"), std::string::npos);
  for (const Panel& panel : figure.panels) {
    EXPECT_EQ(panel.x_range->first, 0);
    EXPECT_EQ(panel.y_range->first, 0);
    EXPECT_GE(panel.y_range->second, 10);
  }
  const Figure negative = LearningCurves({{"a", {MadeRun(1, {{0, -5}, {0, 10}})}}});
  EXPECT_LT(negative.panels[2].y_range->first, -5);
}

TEST(LearningCurve, NoPanelHasMoreThanFiveCurves) {
  std::vector<RunGroup> groups;
  groups.reserve(11);
  for (int i = 0; i < 11; ++i) {
    groups.push_back({std::to_string(i), {MadeRun(1, {{0, 0.0 + i}, {1, 10}})}});
  }
  const Figure figure = LearningCurves(groups);
  ASSERT_EQ(figure.panels.size(), 3 * 4U);
  size_t curves = 0;
  for (size_t i = 0; i < figure.panels.size(); ++i) {
    const Panel& panel = figure.panels[i];
    EXPECT_LE(panel.lines.size(), kMostCurves);
    EXPECT_EQ(panel.x_range, figure.panels[i % 4].x_range);
    EXPECT_EQ(panel.y_range, figure.panels[i % 4].y_range);
    curves += panel.lines.size();
  }
  EXPECT_EQ(curves, 4 * groups.size());
  EXPECT_EQ(LearningCurves({groups.begin(), groups.begin() + 5}).panels.size(), 4U);
}

}  // namespace
}  // namespace upswing
