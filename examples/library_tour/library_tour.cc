// A tour of the library, from the bottom up: an environment, a policy, an agent, and a training
// with evaluations and a checkpoint.
#include <cstdio>
#include <memory>
#include <vector>

#include "base/error.h"
#include "base/policy.h"
#include "base/rng.h"
#include "base/safetensors.h"
#include "pendulum/pendulum_env.h"
#include "rl/dqn.h"
#include "rl/evaluate.h"
#include "rl/trainer.h"

using namespace upswing;

/// Mean reward of `steps` steps with random actions.
double RandomReward(VectorEnv& env, int steps) {
  const EnvSpec& spec = env.spec();
  Rng rng(/*seed=*/1, "random actions");
  std::vector<double> numbers(size_t(env.num_envs() * spec.action_size()));
  const Matrix<double> action(numbers, env.num_envs(), spec.action_size());  // (N × A)
  StepResult result = env.MakeResult();
  double sum = 0;
  for (int k = 0; k < steps; ++k) {
    for (int i = 0; i < env.num_envs(); ++i) {
      for (int a = 0; a < spec.action_size(); ++a) {
        action(i, a) = spec.action_limit[size_t(a)] * rng.Uniform(-1, 1);
      }
    }
    env.Step(action, result);
    for (const double reward : result.reward) sum += reward;
  }
  return sum / steps / env.num_envs();
}

/// A brake: a torque against the velocity of joint 1, the third observation.
class Brake : public Policy {
 public:
  std::string kind() const override { return "brake"; }
  std::string description() const override { return "torque -2 w1"; }
  int obs_size() const override { return kObservationSize; }
  int action_size() const override { return 1; }
  const PolicyInfo& info() const override { return info_; }
  std::unique_ptr<Memory> Start(int) const override { return std::make_unique<Memory>(); }
  void Act(Matrix<const float> obs, Matrix<double> action, Memory&) const override {
    for (int i = 0; i < obs.rows(); ++i) action(i, 0) = -2 * kMaxVelocity1 * obs(i, 2);
  }
  Tensors ToTensors() const override { throw BadInput("a brake has no file"); }

 private:
  PolicyInfo info_;
};

/// A training loop: `steps` steps, then the policy.
std::unique_ptr<Policy> Learn(Agent& agent, VectorEnv& env, int steps) {
  std::vector<double> numbers(size_t(env.num_envs() * env.spec().action_size()));
  const Matrix<double> action(numbers, env.num_envs(), env.spec().action_size());
  StepResult result = env.MakeResult();
  for (int k = 0; k < steps; ++k) {
    agent.Act(env.obs(), action);
    env.Step(action, result);
    agent.Observe(result);
    agent.Learn();
  }
  for (const auto& [name, value] : agent.TakeMetrics()) {
    std::printf("%s %.3g\n", name.c_str(), value);
  }
  return agent.ExportPolicy(PolicyInfo());
}

/// Judges policies from other starts at each evaluation.
struct Starts : Evaluator {
  PendulumEnvConfig config;

  Evaluation Evaluate(const Policy& policy, int64_t step) override {
    config.seed = uint64_t(1000 + step);
    PendulumEnv test(config);
    return upswing::Evaluate(policy, test);
  }
};

int main() try {
  PendulumEnvConfig config;
  config.num_envs = 16;
  PendulumEnv env(config);
  std::printf("reward of random torques: %.2f\n", RandomReward(env, 1000));
  std::printf("return of a brake: %.0f\n", Evaluate(Brake(), env).reward_sum.mean);

  ThreadPool pool(/*threads=*/2);
  DqnConfig small;
  small.hidden = {32};
  small.head = 16;
  Dqn agent(small, env.spec(), /*seed=*/1, pool);
  Learn(agent, env, 500);

  TrainConfig train;
  train.envs = config.num_envs;
  train.steps = 20000;
  Starts evaluator;
  evaluator.config = config;
  Dqn learner(small, env.spec(), /*seed=*/2, pool);
  Trainer trainer(train, learner, env, evaluator);
  while (trainer.Step()) continue;

  Tensors state;
  trainer.State(Archive::Saver(state));
  const std::vector<std::byte> bytes = WriteSafetensors(state).Joined();
  std::printf("%d steps, a checkpoint of %zu bytes\n", int(trainer.state().steps), bytes.size());
} catch (const Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return error.exit_code();
}
