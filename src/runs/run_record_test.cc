#include "runs/run_record.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "os/file.h"
#include "os/testing.h"
#include "runs/testing.h"

namespace upswing {
namespace {

TEST(Runs, SolvedAtTheFirstOfTwoPerfectEvaluationsInARow) {
  EXPECT_EQ(SolvedAt(MadeRun(1, {{0, 0}, {1, 0}, {1, 0}, {0, 0}})), 1U);
  EXPECT_EQ(SolvedAt(MadeRun(1, {{1, 0}, {0.99, 0}, {1, 0}, {0, 0}, {1, 0}, {1, 0}})), 4U);
  EXPECT_FALSE(SolvedAt(MadeRun(1, {{1, 0}, {0.5, 0}, {1, 0}})));
  EXPECT_FALSE(SolvedAt(MadeRun(1, {})));
}

TEST(Runs, AnUnscheduledFinalEvaluationDoesNotCount) {
  RunRecord run = MadeRun(1, {{0, 0}, {1, 0}, {1, 0}}, 2504);
  EXPECT_EQ(SolvedAt(run), 1U);
  run.evaluations.back().step = 2504;  // end of the budget, between two multiples
  EXPECT_FALSE(SolvedAt(run));
  EXPECT_TRUE(Finished(run));
  run.evaluations.back().step = 3000 + 4;  // first multiple of 8 after 3,000
  EXPECT_EQ(SolvedAt(run), 1U);

  // A run that ended at step 2,504 and was resumed: the evaluation at that step does not count.
  RunRecord resumed = MadeRun(1, {{0, 0}, {1, 0}, {0.5, 0}, {1, 0}}, 4000);
  resumed.evaluations[2].step = 2504;
  resumed.evaluations[3].step = 3000;
  EXPECT_EQ(SolvedAt(resumed), 1U);
}

TEST(Runs, FinishedOnceTheBudgetIsUsedOrItWasToStop) {
  EXPECT_FALSE(Finished(MadeRun(1, {})));
  EXPECT_FALSE(Finished(MadeRun(1, {{0, 0}, {1, 0}})));
  EXPECT_TRUE(Finished(MadeRun(1, {{1, 0}, {1, 0}})));
  EXPECT_FALSE(Finished(MadeRun(1, {{1, 0}, {1, 0}}, 5000, false)));
  EXPECT_TRUE(Finished(MadeRun(1, {{0, 0}, {0, 0}}, 2000)));
}

class ReadEvaluationsTest : public testing::Test {
 protected:
  std::string Complaint(const std::string& text) {
    WriteFileAtomically(folder_ / "evals.csv", text);
    try {
      ReadEvaluations(folder_.path(), false);
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      return error.what();
    }
    return "none";
  }
  const std::string head_ =
      "step,success_rate,mean_return,rms_torque,torque_variation,torque_variation_upright,"
      "seconds,value,discounted_return\n";
  TempFolder folder_;
};

TEST_F(ReadEvaluationsTest, VariationOnceUprightIsThatOfEpisodesThatSucceed) {
  WriteFileAtomically(folder_ / "evals.csv",
                      head_ + "1,0,2,3,4,0,5,300,200\n2,0.5,2,1,2,0.25,6,300,200\n");
  const auto rows = ReadEvaluations(folder_.path(), false);
  EXPECT_EQ(rows[0].rms_torque, 3);
  EXPECT_EQ(rows[0].torque_variation, 4);
  EXPECT_EQ(rows[0].upright_variation, EvaluationRow::kUnknown);
  EXPECT_EQ(rows[1].upright_variation, 0.25);
  EXPECT_EQ(rows[1].value_ratio, 1.5);
}

TEST_F(ReadEvaluationsTest, RowsAndNone) {
  EXPECT_TRUE(ReadEvaluations(folder_.path(), false).empty());
  EXPECT_EQ(Complaint(head_ + "1000,0.5,20,1,2,3,1.5,300,200\n2000,1,2600,1,2,3,3,300,200\n"),
            "none");
  const auto rows = ReadEvaluations(folder_.path(), false);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[1].step, 2000);
  EXPECT_EQ(rows[1].success_rate, 1);
  EXPECT_EQ(rows[1].mean_return, 2600);
  EXPECT_EQ(rows[1].seconds, 3);
}

TEST_F(ReadEvaluationsTest, AnIncompleteLineIsAnErrorOrLeftOut) {
  EXPECT_NE(Complaint(head_ + "1000,0,20,1,2,3,1,300,200\n2000,1,26").find("half-written"),
            std::string::npos);
  EXPECT_EQ(ReadEvaluations(folder_.path(), true).size(), 1U);
  EXPECT_NE(Complaint("step,succ").find("half-written"), std::string::npos);
  EXPECT_TRUE(ReadEvaluations(folder_.path(), true).empty());
}

TEST_F(ReadEvaluationsTest, ImpossibleTablesAreRefused) {
  EXPECT_NE(Complaint(head_ + "1000,0,x,1,2,3,1,300,200\n").find("evals.csv:2: mean_return"),
            std::string::npos);
  EXPECT_NE(Complaint("step,seconds\n1,2\n").find("\"success_rate\""), std::string::npos);
  EXPECT_NE(Complaint(head_ + "1000,0,20,1,2,3,1,300,200\n1000,0,20,1,2,3,2,300,200\n")
                .find("increasing steps and seconds"),
            std::string::npos);
  EXPECT_NE(Complaint(head_ + "1000,0,20,1,2,3,1,300,200\n2000,0,20,1,2,3,0.5,300,200\n")
                .find("increasing steps and seconds"),
            std::string::npos);
}

}  // namespace
}  // namespace upswing
