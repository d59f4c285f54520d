#include "runs/comparison.h"

#include <gtest/gtest.h>

#include <limits>

#include "runs/testing.h"

namespace upswing {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

// Three runs are solved after 1, 2 and 3 s. The fourth is never solved, and ends with a worse
// policy than its best.
const RunGroup kGroup{
    "a",
    {MadeRun(1, {{1, 2600}, {1, 2610}}), MadeRun(2, {{0, 9}, {1, 2400}, {1, 2500}}),
     MadeRun(3, {{0, 0}, {0.5, 900}, {1, 2500}, {1, 2550}}),
     MadeRun(4, {{0, 0}, {1, 2450}, {0, 5}, {1, 2440}, {0.75, 1000}})}};

/// The group with its summary.
RunGroup Summarized(RunGroup group) {
  group.summary = Summarize(group);
  return group;
}

TEST(Comparison, ARunThatDidNotSolveNeedsMoreThanItsBudget) {
  const GroupSummary s = Summarize(kGroup);
  EXPECT_EQ(s.solved, 3);
  EXPECT_EQ(s.solved_interval.low, WilsonInterval(3, 4).low);
  EXPECT_EQ(s.solve_seconds.values, (std::vector<double>{1, 2, 3, kInf}));
  EXPECT_EQ(s.solve_steps.values, (std::vector<double>{1000, 2000, 3000, kInf}));
  EXPECT_EQ(s.solve_seconds.median, 2.5);
  EXPECT_EQ(s.solve_seconds.iqm.value, 2.5);  // mean of 2 and 3
  EXPECT_EQ(s.solve_seconds.high, kInf);
  EXPECT_EQ(s.solve_seconds.iqm.interval->high, kInf);

  // Only half of the runs solve, so the median is infinite.
  RunGroup half = kGroup;
  half.runs[0] = MadeRun(5, {{0, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 0}});
  EXPECT_EQ(Summarize(half).solve_seconds.median, kInf);
}

TEST(Comparison, FinalAndBestEvaluation) {
  const GroupSummary s = Summarize(kGroup);
  EXPECT_EQ(s.final_return.values, (std::vector<double>{2610, 2500, 2550, 1000}));
  EXPECT_EQ(s.final_success.values, (std::vector<double>{1, 1, 1, 0.75}));
  EXPECT_EQ(s.best_return.values, (std::vector<double>{2610, 2500, 2550, 2450}));
  EXPECT_EQ(s.best_success.values, (std::vector<double>{1, 1, 1, 1}));
  EXPECT_EQ(s.final_return.iqm.value, 2525);
}

TEST(Comparison, TorquesComeFromTheBestEvaluation) {
  RunGroup group{"a", {MadeRun(1, {{1, 2600}, {1, 2500}}), MadeRun(2, {{0, 0}, {1, 9}})}};
  for (RunRecord& run : group.runs) {
    for (EvaluationRow& row : run.evaluations) {
      row.rms_torque = row.mean_return / 1000;
      row.torque_variation = row.mean_return / 100;
    }
  }
  group.runs[0].evaluations[0].upright_variation = 1.5;
  const GroupSummary s = Summarize(group);
  EXPECT_EQ(s.rms_torque.values, (std::vector<double>{2.6, 0.009}));
  EXPECT_EQ(s.torque_variation.values, (std::vector<double>{26, 0.09}));
  EXPECT_EQ(s.upright_variation.values, (std::vector<double>{1.5, kInf}));
}

TEST(Comparison, StabilityCountsEvaluationsAfterTheTwoThatSolve) {
  EXPECT_EQ(Summarize(kGroup).stability.runs, 0);  // runs stop once solved
  RunGroup group;
  group.runs = {MadeRun(1, {{1, 0}, {1, 0}, {0.99, 0}, {1, 0}, {1, 0}}, 5000, false),
                MadeRun(2, {{0, 0}, {1, 0}, {1, 0}, {0.4, 0}, {1, 0}}, 5000, false),
                MadeRun(3, {{0, 0}, {0, 0}, {0, 0}, {1, 0}, {1, 0}}, 5000, false)};
  const Stability s = Summarize(group).stability;
  EXPECT_EQ(s.runs, 2);
  EXPECT_EQ(s.steady_runs, 1);
  EXPECT_EQ(s.evaluations, 5);
  EXPECT_EQ(s.steady_evaluations, 4);
  EXPECT_EQ(s.lowest, 0.4);
}

TEST(Comparison, PairsAreTheSameFromBothSides) {
  RunGroup fast;
  for (int64_t seed = 1; seed <= 3; ++seed) {
    fast.runs.push_back(
        MadeRun(seed, {{1, 2000.0 + 100.0 * static_cast<double>(seed)}, {1, 2700}}));
  }
  const std::vector<RunGroup> groups{Summarized(kGroup), Summarized(fast)};
  const PairSummary ab = ComparePair(groups, 0, 1);
  const PairSummary ba = ComparePair(groups, 1, 0);
  EXPECT_DOUBLE_EQ(ba.seconds.better.value,
                   (9 + 3 * 0.5) / 12);  // tie with the fastest of the others
  EXPECT_DOUBLE_EQ(ab.seconds.better.value + ba.seconds.better.value, 1);
  EXPECT_EQ(ba.final_return.better.value, 1);
  EXPECT_EQ(ab.final_return.difference->value, 2525 - 2700);
  EXPECT_FALSE(ab.seconds.difference);  // one run has no time

  RunGroup solved = kGroup;
  solved.runs.pop_back();
  EXPECT_EQ(ComparePair({Summarized(solved), groups[1]}, 0, 1).seconds.difference->value, 2 - 1);
}

TEST(Comparison, OneRunHasNoInterval) {
  RunGroup one;
  one.runs = {kGroup.runs[0]};
  one.summary = Summarize(one);
  EXPECT_EQ(one.summary.final_return.iqm.value, 2610);
  EXPECT_FALSE(one.summary.final_return.iqm.interval);
  EXPECT_FALSE(ComparePair({one, Summarized(kGroup)}, 0, 1).seconds.better.interval);
}

}  // namespace
}  // namespace upswing
