#include "runs/slurm.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace upswing {
namespace {

StudyPlan PlanIn(const std::string& folder) {
  StudyPlan plan;
  plan.folder = folder;
  plan.variants.resize(1);
  plan.variants[0].config.train.threads = 1;
  return plan;
}

bool Has(const std::string& text, const std::string& line) {
  return ("\n" + text).find("\n" + line + "\n") != std::string::npos;
}

TEST(SlurmScript, HasTheUsersOptionsAfterItsOwn) {
  const std::string script = SlurmScript(PlanIn("/s"), "--partition=short -t 2:00:00", 7);
  EXPECT_TRUE(script.starts_with("#!/bin/sh\n"));
  EXPECT_TRUE(Has(script, "#SBATCH --array=1-7"));
  EXPECT_TRUE(Has(script, "#SBATCH --output=/s/slurm/%A_%a.log"));
  EXPECT_LT(script.find("#SBATCH --requeue"),
            script.find("#SBATCH --partition=short -t 2:00:00\n"));
  EXPECT_EQ(script.find("--cpus-per-task"), std::string::npos);
}

TEST(SlurmScript, LeavesTheNumberOfTasksToTheUser) {
  for (const std::string options : {"--array=1-3%2", "-p x -a 1-3", "-a1-3", "--arr 1-3"}) {
    const std::string script = SlurmScript(PlanIn("/s"), options, 7);
    EXPECT_EQ(script.find("1-7"), std::string::npos) << options;
  }
  EXPECT_TRUE(Has(SlurmScript(PlanIn("/s"), "--account=a", 7), "#SBATCH --array=1-7"));
}

TEST(SlurmScript, AsksForTheThreadsOfTheRuns) {
  StudyPlan plan = PlanIn("/s");
  plan.variants[0].config.train.threads = 3;
  EXPECT_TRUE(Has(SlurmScript(plan, "", 1), "#SBATCH --cpus-per-task=3"));
}

TEST(SlurmScript, QuotesTheFolder) {
  const std::string script = SlurmScript(PlanIn("/a $(id) 10%/"), "", 1);
  EXPECT_NE(script.find(" study --work '/a $(id) 10%' &\n"), std::string::npos);
  EXPECT_TRUE(Has(script, "#SBATCH --output='/a $(id) 10%%/slurm/%A_%a.log'"));
}

TEST(SlurmScript, RefusesWhatCannotStandOnALine) {
  EXPECT_THROW(SlurmScript(PlanIn("/a\nb"), "", 1), Error);
  EXPECT_THROW(SlurmScript(PlanIn("/a\\b"), "", 1), Error);
  EXPECT_THROW(SlurmScript(PlanIn("/a"), "--partition=x\nrm -r /", 1), Error);
  EXPECT_THROW(SlurmScript(PlanIn("/a"), "partition=x", 1), Error);
}

}  // namespace
}  // namespace upswing
