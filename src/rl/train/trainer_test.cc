#include "rl/train/trainer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <string>

#include "base/error.h"
#include "base/safetensors.h"
#include "base/text.h"
#include "rl/dqn/dqn.h"
#include "rl/ppo/ppo.h"
#include "rl/toy_env_testing.h"

namespace upswing {
namespace {

/// Small trainings on the toy environment with scripted evaluations.
class TrainerTest : public ::testing::Test, protected TrainObserver, protected Evaluator {
 protected:
  TrainerTest() {
    config_.steps = 600;
    config_.eval_every = 100;
    config_.log_every = 50;
    dqn_.hidden = {8};
    dqn_.dueling = false;
    dqn_.off_policy.batch = 8;
    dqn_.off_policy.learning_starts = 20;
    dqn_.levels = 3;
  }

  /// A training and all of its parts.
  struct Parts {
    ThreadPool pool{1};
    ToyEnv env{4};
    Dqn agent;
    Trainer trainer;
    Parts(const DqnConfig& dqn, const TrainConfig& config, Evaluator& evaluator,
          TrainObserver& observer)
        : agent(dqn, env.spec(), 1, pool), trainer(config, agent, env, evaluator) {
      trainer.AddObserver(observer);
    }
  };

  Parts Make() { return {dqn_, config_, *this, *this}; }

  Evaluation Evaluate(const Policy& /*policy*/, int64_t /*step*/) override {
    Evaluation e;
    e.episodes = 4;
    e.successes = static_cast<size_t>(evaluations_) < scripted_.size()
                      ? scripted_[static_cast<size_t>(evaluations_)]
                      : 0;
    ++evaluations_;
    e.reward_sum.mean = evaluations_;
    e.passed = e.successes == 4;
    return e;
  }

  std::optional<Evaluation> Confirm(const Policy& /*policy*/, int64_t step) override {
    if (confirmations_.empty()) return std::nullopt;
    Evaluation e;
    e.episodes = 4;
    e.successes = confirmations_.at(confirmed_.size());
    e.reward_sum.mean = 0.5;  // less than in any other evaluation
    e.passed = e.successes == 4;
    confirmed_.push_back(step);
    return e;
  }

  /// Trains to the end and returns the final state.
  TrainState Run() {
    Parts parts = Make();
    while (parts.trainer.Step()) continue;
    return parts.trainer.state();
  }

  void OnEpisode(const TrainState& s, const FinishedEpisode& e) override {
    episodes_.push_back({s.steps, e.reward_sum});
  }
  void OnMetrics(const TrainState& s, const Metrics&) override { metrics_.push_back(s.steps); }
  void OnBest(const TrainState&, const Policy& policy) override {
    best_.push_back(*policy.info().step);
  }

  TrainConfig config_;
  DqnConfig dqn_;
  std::vector<int64_t> scripted_;  // successes out of 4, one per evaluation
  int evaluations_ = 0;
  // The stricter evaluation, if there is one: successes out of 4, and the steps at which it was
  // called.
  std::vector<int64_t> confirmations_, confirmed_;
  // The calls that the observer received.
  std::vector<std::pair<int64_t, double>> episodes_;  // step and return
  std::vector<int64_t> metrics_, best_;               // steps
};

TEST_F(TrainerTest, StopsWhenTwoEvaluationsInARowArePassed) {
  scripted_ = {4, 3, 4, 4, 4};
  const TrainState state = Run();
  EXPECT_TRUE(state.solved);
  EXPECT_EQ(state.steps, 400);
  EXPECT_EQ(state.streak_step, 300);  // first of the two passed evaluations
}

TEST_F(TrainerTest, AnUnscheduledFinalEvaluationDoesNotCount) {
  scripted_ = {0, 0, 4, 4};
  config_.steps = 304;
  EXPECT_FALSE(Run().solved);
  EXPECT_EQ(evaluations_, 4);
}

TEST_F(TrainerTest, ContinuesAfterSolvingIfNotToStop) {
  scripted_ = {4, 4, 0, 4, 4, 4};
  config_.stop_when_solved = false;
  const TrainState state = Run();
  EXPECT_TRUE(state.solved);
  EXPECT_EQ(state.steps, 600);
  EXPECT_EQ(state.streak_step, 100);
  EXPECT_EQ(evaluations_, 6);
}

TEST_F(TrainerTest, ReportsTheBestPolicyByItsSuccessAndThenItsReturn) {
  scripted_ = {1, 3, 2, 3, 1, 0};  // the scripted return rises by one with each evaluation
  EXPECT_EQ(Run().best_step, 400);
  EXPECT_EQ(best_, (std::vector<int64_t>{100, 200, 400}));
}

TEST_F(TrainerTest, SolvedIsConfirmedOnceAndThatPolicyIsTheBest) {
  scripted_ = {4, 4, 4};
  confirmations_ = {4};
  const TrainState state = Run();
  EXPECT_TRUE(state.solved);
  EXPECT_EQ(state.streak_step, 100);
  EXPECT_EQ(confirmed_, (std::vector<int64_t>{200}));
  EXPECT_EQ(state.best_step, 200);
  EXPECT_EQ(state.best_return, 0.5);  // from the stricter evaluation
  EXPECT_EQ(best_, (std::vector<int64_t>{100, 200}));
}

TEST_F(TrainerTest, WhereItIsNotConfirmedTheStreakStartsAgain) {
  scripted_ = {4, 4, 4, 4, 4, 4};
  confirmations_ = {3, 4};
  const TrainState state = Run();
  EXPECT_TRUE(state.solved);
  EXPECT_EQ(state.streak_step, 300);
  EXPECT_EQ(confirmed_, (std::vector<int64_t>{200, 400}));
  EXPECT_EQ(best_, (std::vector<int64_t>{100, 200, 300, 400}));
}

TEST_F(TrainerTest, OnceSolvedABetterPolicyIsConfirmedToo) {
  scripted_ = {4, 4, 3, 4, 4, 0};
  confirmations_ = {4, 3, 4};
  config_.stop_when_solved = false;
  const TrainState state = Run();
  EXPECT_TRUE(state.solved);
  EXPECT_EQ(confirmed_, (std::vector<int64_t>{200, 400, 500}));
  EXPECT_EQ(state.best_step, 200);
}

/// Trainings whose evaluations run in the background: an evaluation ends only after the training
/// has gone on for some steps.
class TrainerBackgroundTest : public TrainerTest {
 protected:
  bool CanRunInBackground() const override { return may_be_in_background_; }
  void ShareThreads(bool shared) override {
    in_background_ = shared;
    if (shared) ++times_in_background_;
  }
  Evaluation Evaluate(const Policy& policy, int64_t step) override {
    if (step == fails_at_) throw Failure("no evaluation");
    if (in_background_) {
      const int64_t enough = std::min(step + 40, config_.steps);
      for (int64_t now = steps_; now < enough; now = steps_) steps_.wait(now);
    }
    return TrainerTest::Evaluate(policy, step);
  }

  void OnEpisode(const TrainState& s, const FinishedEpisode& e) override {
    events_.push_back(Concat("episode of ", e.reward_sum, EvaluatedTo(s)));
  }
  void OnMetrics(const TrainState& s, const Metrics& metrics) override {
    events_.push_back(Concat("loss ", metrics.back().second, EvaluatedTo(s)));
  }
  void OnBest(const TrainState& s, const Policy& policy) override {
    events_.push_back(Concat("best of step ", *policy.info().step, EvaluatedTo(s)));
  }
  void OnEvaluation(const TrainState& s, const Evaluation& e) override {
    events_.push_back(Concat("evaluation with ", e.successes, EvaluatedTo(s)));
  }

  /// Trains to the end. Returns all events.
  std::vector<std::string> Events(bool background) {
    may_be_in_background_ = background;
    events_.clear();
    evaluations_ = 0;
    confirmed_.clear();
    Proceed(0);
    Parts parts = Make();
    while (parts.trainer.Step()) Proceed(parts.trainer.state().steps);
    return events_;
  }

  /// Lets evaluations see the training at `step`.
  void Proceed(int64_t step) {
    steps_ = step;
    steps_.notify_all();
  }

  std::vector<std::string> events_;
  bool may_be_in_background_ = true;
  int times_in_background_ = 0;
  int64_t fails_at_ = -1;                    // step of an evaluation that throws
  std::atomic<bool> in_background_ = false;  // whether the threads are shared

 private:
  /// Step, mean return, and the results of evaluations.
  static std::string EvaluatedTo(const TrainState& s) {
    return Concat(" at ", s.steps, " with ", s.mean_return(), ", best ", s.best_step, ", streak ",
                  s.streak, ", last ", s.last_success_rate);
  }

  std::atomic<int64_t> steps_ = 0;  // of the training
};

TEST_F(TrainerBackgroundTest, EventsAreThoseOfEvaluationsThatInterrupt) {
  for (const bool stops : {true, false}) {
    config_.stop_when_solved = stops;
    for (const auto& script : std::vector<std::vector<int64_t>>{
             {0, 1, 3, 2, 4, 1}, {1, 4, 3, 4, 4}, {4, 4, 4, 4, 4, 4}}) {
      scripted_ = script;
      confirmations_ = {3, 4, 4, 4, 4, 4};
      const std::vector<std::string> expected = Events(false);
      EXPECT_EQ(times_in_background_, 0);
      EXPECT_EQ(Events(true), expected);
      EXPECT_GE(std::exchange(times_in_background_, 0), 2);
    }
  }
}

TEST_F(TrainerBackgroundTest, AnEvaluationThatMayEndTheTrainingInterruptsIt) {
  scripted_ = {4, 4};
  Events(true);
  EXPECT_EQ(times_in_background_, 1);
  EXPECT_EQ(events_.back().substr(0, 17), "evaluation with 4");
  EXPECT_NE(events_.back().find(" at 200 "), std::string::npos);
}

TEST_F(TrainerBackgroundTest, SavedStatesContainTheResult) {
  scripted_ = {3};
  Parts parts = Make();
  while (parts.trainer.state().steps < 100) parts.trainer.Step();
  EXPECT_EQ(parts.trainer.state().best_step, 0);  // the evaluation still runs
  Proceed(1000);
  Tensors saved;
  parts.trainer.State(Archive::Saver(saved));
  EXPECT_EQ(parts.trainer.state().best_step, 100);
}

TEST_F(TrainerBackgroundTest, AFailureOfTheTrainingComesAfterTheResult) {
  scripted_ = {3};
  Parts parts = Make();
  while (parts.trainer.state().steps < 100) parts.trainer.Step();
  parts.env.poison = true;
  Proceed(1000);
  EXPECT_THROW(parts.trainer.Step(), Error);
  EXPECT_EQ(parts.trainer.state().best_step, 100);
}

TEST_F(TrainerBackgroundTest, AFailureOfAnEvaluationEndsTheTraining) {
  fails_at_ = 200;
  EXPECT_THROW(Events(true), Error);
  EXPECT_FALSE(in_background_);  // the training has all threads again
  EXPECT_EQ(events_.back().find(" at 300"), std::string::npos) << events_.back();
}

TEST_F(TrainerBackgroundTest, ATrainingMayWaitForEachEvaluation) {
  scripted_ = {1, 2, 3};
  Parts parts = Make();
  parts.trainer.WaitForEvaluations();
  while (parts.trainer.Step()) EXPECT_FALSE(parts.trainer.is_evaluating());
  EXPECT_EQ(times_in_background_, 0);
}

TEST_F(TrainerBackgroundTest, DeferredEventsNeedNoMemoryForRunningEpisodes) {
  const TrainState state(1000, 3);
  EXPECT_TRUE(state.WithoutEpisodes().episode_return.empty());
  EXPECT_TRUE(state.WithoutEpisodes().episode_terms.empty());
}

TEST_F(TrainerTest, ReportsMetricsAtTheirIntervalAndEachEpisodeOnce) {
  const TrainState state = Run();
  EXPECT_EQ(metrics_.size(), 12U);
  EXPECT_EQ(metrics_.front(), 52);  // the first step of four environments that passes 50
  EXPECT_EQ(static_cast<int64_t>(episodes_.size()), state.episodes);
  double sum = 0;
  for (const auto& [step, reward_sum] : episodes_) sum += reward_sum;
  EXPECT_NEAR(state.mean_return(), sum / static_cast<double>(episodes_.size()), 1e-12);
}

TEST_F(TrainerTest, StoppedAndResumedEqualsNeverStopped) {
  const auto bytes = [](Trainer& trainer) {
    Tensors saved;
    trainer.State(Archive::Saver(saved));
    return WriteSafetensors(saved).Joined();
  };
  Parts whole = Make();
  while (whole.trainer.Step()) continue;
  const auto expected_episodes = std::exchange(episodes_, {});

  evaluations_ = 0;
  std::vector<std::byte> saved;
  for (const int64_t stop : {4, 36, 100, 104, 333, 1000000}) {
    Parts part = Make();
    if (!saved.empty()) {
      const Tensors loaded = ReadSafetensors(saved, "saved");
      part.trainer.State(Archive::Loader(loaded));
    }
    while (part.trainer.state().steps < stop && part.trainer.Step()) continue;
    saved = bytes(part.trainer);
  }
  EXPECT_EQ(episodes_, expected_episodes);
  // Compare everything except the clock.
  const Tensors a = ReadSafetensors(bytes(whole.trainer), "whole");
  const Tensors b = ReadSafetensors(saved, "parts");
  for (const auto& [name, tensor] : a.all()) {
    if (name == "train/seconds" || name == "train/streak_seconds") continue;
    EXPECT_TRUE(std::ranges::equal(tensor.bytes, b.all().at(name).bytes)) << name;
  }
}

/// A toy environment that cannot continue saved episodes.
class Forgetful : public ToyEnv {
 public:
  using ToyEnv::ToyEnv;
  Matrix<const float> broken_off() const override {
    return {last_.data(), static_cast<int>(last_.size()), 1};
  }
  void State(const Archive& archive) override {
    ToyEnv::State(archive);
    if (archive.loading()) last_.assign(obs().data(), obs().data() + num_envs());
  }

 private:
  std::vector<float> last_;
};

TEST_F(TrainerTest, EpisodesThatAnEnvironmentCannotContinueAreTruncated) {
  ThreadPool pool(1);
  dqn_.off_policy.n_step = 3;
  PpoConfig ppo;
  ppo.hidden = {8};
  ppo.horizon = 16;
  ppo.batch = 8;
  const EnvSpec spec = ToyEnv::Spec(4);
  const std::vector<std::function<std::unique_ptr<Agent>()>> agents{
      [&] { return std::make_unique<Dqn>(dqn_, spec, 1, pool); },
      [&] { return std::make_unique<Ppo>(ppo, spec, 1, pool); }};
  for (const auto& make : agents) {
    Forgetful env(4), again(4);
    const auto agent = make(), resumed = make();
    Trainer trainer(config_, *agent, env, *this), other(config_, *resumed, again, *this);
    while (trainer.state().steps < 100) trainer.Step();  // episodes and rollout are unfinished
    Tensors saved;
    trainer.State(Archive::Saver(saved));
    other.State(Archive::Loader(saved));
    EXPECT_EQ(other.state().episode_length, std::vector<int64_t>(4, 0));
    EXPECT_EQ(other.state().episode_return, std::vector<double>(4, 0));
    Tensors after;
    other.State(Archive::Saver(after));
    if (&make == &agents.front()) {
      const auto& waiting = after.all().at("agent/n_step/count").bytes;
      EXPECT_TRUE(std::ranges::all_of(waiting, [](std::byte b) { return b == std::byte{0}; }));
    } else {
      const auto& truncated = after.all().at("agent/rollout/truncated").bytes;
      EXPECT_EQ(std::ranges::count(truncated.last(4), std::byte{1}), 4);
    }
    while (other.state().steps < 200) other.Step();
    EXPECT_EQ(other.state().steps, 200);
  }
}

TEST_F(TrainerTest, TheCurriculumRaisesTheNoiseLinearly) {
  TrainConfig config;
  config.start_noise = 0.1;
  config.start_noise_end = 0.3;
  config.curriculum_steps = 1000;
  EXPECT_DOUBLE_EQ(config.StartNoise(0), 0.1);
  EXPECT_DOUBLE_EQ(config.StartNoise(500), 0.2);
  EXPECT_DOUBLE_EQ(config.StartNoise(5000), 0.3);
}

TEST_F(TrainerTest, ANumberThatIsNotFiniteIsAFailure) {
  Parts parts = Make();
  while (parts.trainer.state().steps < 200) parts.trainer.Step();
  parts.env.poison = true;
  EXPECT_THROW(parts.trainer.Step(), Error);
}

}  // namespace
}  // namespace upswing
