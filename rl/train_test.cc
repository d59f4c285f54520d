#include "rl/train.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "core/error.h"
#include "core/file.h"
#include "core/testing.h"
#include "rl/dqn.h"
#include "rl/toy_env.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// A small training on the toy environment in a folder of its own.
class TrainTest : public ::testing::Test {
 protected:
  TrainTest() {
    config_.steps = 600;
    config_.eval_every = 100;
    config_.log_every = 50;
    config_.checkpoint_every = 70;
    dqn_.hidden = {8};
    dqn_.dueling = false;
    dqn_.batch = 8;
    dqn_.learning_starts = 20;
  }

  struct Parts {
    ThreadPool pool;
    ToyEnv env;
    Dqn agent;
    TrainState state;
    explicit Parts(const DqnConfig& dqn)
        : pool(1), env(4), agent(dqn, 4, 1, {-1, 0, 1}, env.mirror_signs(), 1, pool), state(4, 1) {}
  };

  void Create(const std::string& name) {
    Parts parts(dqn_);
    RunFolder::Create(folder_ / name, {{"config.toml", ""}}, [&](TensorFile& checkpoint) {
      CheckpointState(Archive::Saver(checkpoint), parts.agent, parts.env, parts.state);
    });
  }

  /// Continues a run until `stop_at`; returns the state at the end.
  TrainState Run(const std::string& name, int64_t stop_at = 1000000) {
    Parts parts(dqn_);
    const TensorFile checkpoint = TensorFile::Load(RunFolder::CheckpointPath(folder_ / name));
    CheckpointState(Archive::Loader(checkpoint), parts.agent, parts.env, parts.state);
    parts.env.poison = parts.state.steps < poison_after_ && poison_after_ > 0;
    RunFolder run(folder_ / name, checkpoint);
    Training t{config_, parts.agent, parts.env, run};
    t.evaluate = [&](const Policy&, int64_t) {
      Evaluation e;
      e.episodes = 4;
      e.successes = static_cast<size_t>(evaluations_) < scripted_.size()
                        ? scripted_[static_cast<size_t>(evaluations_)]
                        : 0;
      ++evaluations_;
      e.reward_sum.mean = evaluations_;
      return e;
    };
    t.poll = [&] {
      return parts.state.steps >= stop_at ? TrainRequest::kStop : TrainRequest::kGoOn;
    };
    Train(t, parts.state);
    return parts.state;
  }

  TempFolder temp_;
  fs::path folder_ = temp_.path();
  TrainConfig config_;
  DqnConfig dqn_;
  std::vector<int64_t> scripted_;  // successes of 4, one for each evaluation
  int evaluations_ = 0;
  int64_t poison_after_ = 0;
};

TEST_F(TrainTest, StopsWhenTwoEvaluationsInARowAreFull) {
  scripted_ = {4, 3, 4, 4, 4};
  Create("run");
  const TrainState state = Run("run");
  EXPECT_TRUE(state.solved);
  EXPECT_EQ(state.steps, 400);
  EXPECT_EQ(state.streak_step, 300);  // the first of the two
}

TEST_F(TrainTest, AnUnscheduledFinalEvaluationDoesNotCount) {
  scripted_ = {0, 0, 4, 4};
  config_.steps = 304;
  Create("run");
  EXPECT_FALSE(Run("run").solved);
  EXPECT_EQ(evaluations_, 4);
}

TEST_F(TrainTest, ContinuesAfterSolvingIfNotToStop) {
  scripted_ = {4, 4, 0, 4, 4, 4};
  config_.stop_when_solved = false;
  Create("run");
  const TrainState state = Run("run");
  EXPECT_TRUE(state.solved);
  EXPECT_EQ(state.steps, 600);
  EXPECT_EQ(state.streak_step, 100);
  EXPECT_EQ(evaluations_, 6);
}

TEST_F(TrainTest, KeepsTheBestPolicyByItsSuccessAndThenItsReturn) {
  scripted_ = {1, 3, 2, 3, 1, 0};  // the scripted return rises by one with each evaluation
  Create("run");
  const TrainState state = Run("run");
  EXPECT_EQ(state.best_step, 400);
  EXPECT_EQ(Policy::Load(folder_ / "run" / "policy.safetensors").info().step, 400);
}

TEST_F(TrainTest, StoppedAndResumedEqualsNeverStopped) {
  Create("whole");
  Run("whole");
  Create("parts");
  evaluations_ = 0;
  for (const int64_t stop : {4, 36, 100, 104, 333}) Run("parts", stop);
  Run("parts");
  for (const char* file : {"policy.safetensors", "episodes.csv"}) {
    EXPECT_EQ(ReadFile(folder_ / "whole" / file), ReadFile(folder_ / "parts" / file)) << file;
  }
}

TEST_F(TrainTest, TheCurriculumRaisesTheNoiseLinearly) {
  TrainConfig config;
  config.start_noise = 0.1;
  config.start_noise_end = 0.3;
  config.curriculum_steps = 1000;
  EXPECT_DOUBLE_EQ(config.StartNoise(0), 0.1);
  EXPECT_DOUBLE_EQ(config.StartNoise(500), 0.2);
  EXPECT_DOUBLE_EQ(config.StartNoise(5000), 0.3);
}

TEST_F(TrainTest, ANumberThatIsNotFiniteStopsTheTrainingAndKeepsTheCheckpoint) {
  Create("run");
  Run("run", 200);
  const auto checkpoint = ReadFile(folder_ / "run" / "checkpoint.safetensors");
  poison_after_ = 1000;
  try {
    Run("run");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 1);
    const std::string message = error.what();
    EXPECT_NE(message.find("step 200"), std::string::npos) << message;
    EXPECT_NE(message.find("checkpoint of step 200"), std::string::npos) << message;
  }
  EXPECT_EQ(ReadFile(folder_ / "run" / "checkpoint.safetensors"), checkpoint);
}

TEST_F(TrainTest, LogEscapesLineBreaks) {
  Create("run");
  const TensorFile checkpoint = TensorFile::Load(RunFolder::CheckpointPath(folder_ / "run"));
  RunFolder(folder_ / "run", checkpoint).Log("failed: x\n2026-01-01 finished\x1b[2J");
  const std::string log = ReadTextFile(folder_ / "run" / "log.txt");
  EXPECT_NE(log.find(R"(Z failed: x\n2026-01-01 finished\x1b[2J)"), std::string::npos) << log;
}

TEST_F(TrainTest, ARunIsNeverOverwritten) {
  Create("run");
  EXPECT_THROW(Create("run"), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

}  // namespace
}  // namespace upswing
