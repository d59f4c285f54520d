#include "run/training_run.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "core/error.h"
#include "io/file.h"
#include "io/testing.h"
#include "run/config_files.h"
#include "run/this_host.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Small trainings in folders of their own.
class TrainingRunTest : public ::testing::Test {
 protected:
  static Config SmallConfig() {
    return BuildConfig("", {{"agent", "fast"},
                            {"hidden", "8"},
                            {"head", "4"},
                            {"envs", "4"},
                            {"steps", "1200"},
                            {"eval_every", "400"},
                            {"eval_episodes", "2"},
                            {"eval_physics", "closed-form"},
                            {"log_every", "100"},
                            {"checkpoint_every", "140"},
                            {"learning_starts", "40"},
                            {"batch", "8"},
                            {"threads", "1"}});
  }

  /// Stops at a step.
  struct StopAt : TrainingRun::Driver {
    explicit StopAt(int64_t step) : stop(step) {}
    TrainRequest AfterStep(const TrainState& s) override {
      return s.steps >= stop ? TrainRequest::kStop : TrainRequest::kGoOn;
    }
    int64_t stop;
  };

  /// Everything that does not depend on the clock.
  static void ExpectSame(const fs::path& a, const fs::path& b) {
    EXPECT_EQ(ReadFile(a / RunFolder::kPolicy), ReadFile(b / RunFolder::kPolicy));
    EXPECT_EQ(ReadTextFile(a / RunFolder::kEpisodes), ReadTextFile(b / RunFolder::kEpisodes));
  }

  TempFolder temp_;
};

TEST_F(TrainingRunTest, StoppedAndResumedEqualsNeverStopped) {
  StopAt never(std::numeric_limits<int64_t>::max());
  EXPECT_TRUE(TrainingRun::Make(temp_ / "whole", SmallConfig())->Train(never));

  StopAt at_once(4);
  EXPECT_FALSE(TrainingRun::Make(temp_ / "parts", SmallConfig())->Train(at_once));
  for (const int64_t step : {36, 100, 404, 777}) {
    StopAt stop(step);
    EXPECT_FALSE(TrainingRun::Resume(temp_ / "parts")->Train(stop));
  }
  EXPECT_TRUE(TrainingRun::Resume(temp_ / "parts")->Train(never));
  ExpectSame(temp_ / "whole", temp_ / "parts");
}

TEST_F(TrainingRunTest, ARunInWorkIsLockedAndNeverOverwritten) {
  const auto run = TrainingRun::Make(temp_ / "run", SmallConfig());
  EXPECT_THROW(TrainingRun::Resume(temp_ / "run"), Error);
  EXPECT_THROW(TrainingRun::Make(temp_ / "run", SmallConfig()), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(temp_.path()), {}), 1);
}

TEST_F(TrainingRunTest, AFailureNamesItsStepAndKeepsTheLastCheckpoint) {
  // Fails after step 300 as a full disk or a number that is not finite would.
  struct Fail : TrainingRun::Driver {
    TrainRequest AfterStep(const TrainState& s) override {
      if (s.steps >= 300) throw Failure("enough");
      return TrainRequest::kGoOn;
    }
  } fail;
  try {
    TrainingRun::Make(temp_ / "run", SmallConfig())->Train(fail);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 1);
    EXPECT_EQ(std::string(error.what()),
              "training stopped at step 300: enough; the checkpoint of step 280 is kept in " +
                  (temp_ / "run").string());
  }
  const auto resumed = TrainingRun::Resume(temp_ / "run");
  EXPECT_EQ(resumed->training().state().steps, 280);
}

TEST_F(TrainingRunTest, LogEscapesLineBreaks) {
  struct Fail : TrainingRun::Driver {
    TrainRequest AfterStep(const TrainState&) override {
      throw Failure("x\n2026-01-01 finished\x1b[2J");
    }
  } fail;
  EXPECT_THROW(TrainingRun::Make(temp_ / "run", SmallConfig())->Train(fail), Error);
  const std::string log = ReadTextFile(temp_ / "run" / RunFolder::kLog);
  EXPECT_NE(log.find(R"(x\n2026-01-01 finished\x1b[2J)"), std::string::npos) << log;
}

TEST_F(TrainingRunTest, ATrainingInMemoryGivesThePolicyOfTheRun) {
  StopAt never(std::numeric_limits<int64_t>::max());
  const auto run = TrainingRun::Make(temp_ / "run", SmallConfig());
  EXPECT_TRUE(run->Train(never));
  Training training(SmallConfig(), ThisHost(1));
  while (training.Step()) continue;
  EXPECT_EQ(training.state().steps, run->training().state().steps);
  EXPECT_EQ(training.state().best_return, run->training().state().best_return);
}

}  // namespace
}  // namespace upswing
