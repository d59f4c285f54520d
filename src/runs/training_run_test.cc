#include "runs/training_run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "os/file.h"
#include "os/testing.h"
#include "runs/config_files.h"
#include "runs/this_host.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Small trainings, each in its own folder.
class TrainingRunTest : public ::testing::Test {
 protected:
  static constexpr int64_t kNever = std::numeric_limits<int64_t>::max();

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

  /// Trains a run until `step`. Returns whether it has ended.
  static bool TrainUntil(int64_t step, TrainingRun& run) {
    TrainObserver no_view;
    return run.Train(no_view, [&] {
      const bool stop = run.training().state().steps >= step;
      return stop ? TrainRequest::kStop : TrainRequest::kGoOn;
    });
  }

  /// Trains a run until `step`, where it fails as on a full disk.
  static void FailAt(int64_t step, const std::string& why, TrainingRun& run) {
    TrainObserver no_view;
    run.Train(no_view, [&] {
      if (run.training().state().steps >= step) throw Failure(why);
      return TrainRequest::kGoOn;
    });
  }

  /// Compares everything that does not depend on the clock.
  static void ExpectSame(const fs::path& a, const fs::path& b) {
    EXPECT_EQ(ReadOwnBytes(a / RunFolder::kPolicy), ReadOwnBytes(b / RunFolder::kPolicy));
    EXPECT_EQ(ReadOwnFile(a / RunFolder::kEpisodes), ReadOwnFile(b / RunFolder::kEpisodes));
  }

  /// The rows of a table without the column `seconds`.
  static std::vector<std::vector<std::string>> WithoutClock(const fs::path& table) {
    std::vector<std::vector<std::string>> rows;
    const std::string text = ReadOwnFile(table);
    for (const std::string_view line : Split(text, '\n')) {
      const std::vector<std::string_view> cells = Split(line, ',');
      rows.emplace_back(cells.begin(), cells.end());
    }
    const auto clock = std::ranges::find(rows.at(0), "seconds") - rows[0].begin();
    for (auto& row : rows) {
      if (clock < std::ssize(row)) row.erase(row.begin() + clock);
    }
    return rows;
  }

  TempFolder temp_;
};

TEST_F(TrainingRunTest, StoppedAndResumedEqualsNeverStopped) {
  EXPECT_TRUE(TrainUntil(kNever, *TrainingRun::Make(temp_ / "whole", SmallConfig())));

  EXPECT_FALSE(TrainUntil(4, *TrainingRun::Make(temp_ / "parts", SmallConfig())));
  for (const int64_t step : {36, 100, 404, 777}) {
    EXPECT_FALSE(TrainUntil(step, *TrainingRun::Resume(temp_ / "parts")));
  }
  EXPECT_TRUE(TrainUntil(kNever, *TrainingRun::Resume(temp_ / "parts")));
  ExpectSame(temp_ / "whole", temp_ / "parts");
}

TEST_F(TrainingRunTest, EvaluationsInTheBackgroundChangeNoFile) {
  EXPECT_TRUE(TrainUntil(kNever, *TrainingRun::Make(temp_ / "one", SmallConfig())));

  Config config = SmallConfig();
  config.train.threads = 3;
  EXPECT_TRUE(TrainUntil(kNever, *TrainingRun::Make(temp_ / "three", config)));
  ExpectSame(temp_ / "one", temp_ / "three");
  for (const char* table : {RunFolder::kEvaluations, RunFolder::kMetrics}) {
    EXPECT_EQ(WithoutClock(temp_ / "one" / table), WithoutClock(temp_ / "three" / table));
  }

  config.train.checkpoint_every = config.train.eval_every;  // both are due at once
  const auto together = TrainingRun::Make(temp_ / "together", config);
  int in_background = 0;
  TrainObserver no_view;
  EXPECT_TRUE(together->Train(no_view, [&] {
    if (together->training().trainer().is_evaluating()) ++in_background;
    return TrainRequest::kGoOn;
  }));
  EXPECT_GT(in_background, 0);
  ExpectSame(temp_ / "one", temp_ / "together");

  EXPECT_FALSE(TrainUntil(404, *TrainingRun::Make(temp_ / "parts", config)));
  EXPECT_THROW(FailAt(812, "enough", *TrainingRun::Resume(temp_ / "parts")), Error);
  EXPECT_TRUE(TrainUntil(kNever, *TrainingRun::Resume(temp_ / "parts")));
  ExpectSame(temp_ / "one", temp_ / "parts");
}

TEST_F(TrainingRunTest, ARunInWorkIsLockedAndNeverOverwritten) {
  const auto run = TrainingRun::Make(temp_ / "run", SmallConfig());
  EXPECT_THROW(TrainingRun::Resume(temp_ / "run"), Error);
  EXPECT_THROW(TrainingRun::Make(temp_ / "run", SmallConfig()), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(temp_.path()), {}), 1);
}

TEST_F(TrainingRunTest, AFailureNamesItsStepAndKeepsTheLastCheckpoint) {
  try {
    FailAt(300, "enough", *TrainingRun::Make(temp_ / "run", SmallConfig()));
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
  const auto run = TrainingRun::Make(temp_ / "run", SmallConfig());
  EXPECT_THROW(FailAt(0, "x\n2026-01-01 finished\x1b[2J", *run), Error);
  const std::string log = ReadOwnFile(temp_ / "run" / RunFolder::kLog);
  EXPECT_NE(log.find(R"(x\n2026-01-01 finished\x1b[2J)"), std::string::npos) << log;
}

TEST_F(TrainingRunTest, ATrainingInMemoryGivesThePolicyOfTheRun) {
  const auto run = TrainingRun::Make(temp_ / "run", SmallConfig());
  EXPECT_TRUE(TrainUntil(kNever, *run));
  Training training(SmallConfig(), ThisHost(1));
  while (training.Step()) continue;
  EXPECT_EQ(training.state().steps, run->training().state().steps);
  EXPECT_EQ(training.state().best_return, run->training().state().best_return);
}

}  // namespace
}  // namespace upswing
