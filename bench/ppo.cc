#include "rl/ppo.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>

#include "bench/bench.h"
#include "sim/pendulum_v1.h"

namespace upswing {
namespace {

constexpr int kEnvs = 4;

/// PPO in the form that peers have too: rollouts of about 4096 steps, which minibatches divide, two
/// epochs, no extension.
PpoConfig BareConfig(const std::vector<int64_t>& hidden, int64_t batch) {
  PpoConfig config;
  config.hidden = hidden;
  config.batch = batch;
  config.horizon = batch * std::max<int64_t>(1, 1024 / batch);
  config.epochs = 2;
  config.kl_target = 0;
  config.normalize = false;
  return config;
}

/// Operations of a network for one step: its forward pass when the rollout is made or valued, and
/// in each epoch forward, backward and the gradient of the weights.
double StepFlops(const PpoConfig& config, int obs_size) {
  const Network network(config.Shape(obs_size, 1));
  const double all = network.multiply_adds();
  const double first = static_cast<double>(obs_size) * config.hidden.front();
  return 2 * (all + static_cast<double>(config.epochs) * (3 * all - first));
}

/// Environments and agent of a case.
struct Parts {
  BenchPool pool;
  PendulumV1 env;
  Ppo agent;
  StepResult result;
  std::vector<double> action;

  Parts(const PpoConfig& config, int threads)
      : pool(threads),
        env({kEnvs, 1, "benchmark"}),
        agent(config, env.spec(), 1, pool),
        result(env.spec()),
        action(kEnvs) {}

  /// A rollout, and what is learned from it.
  void Rollout(int64_t horizon) {
    const Matrix<double> actions(action.data(), kEnvs, 1);
    for (int64_t t = 0; t < horizon; ++t) {
      agent.Act(env.obs(), actions);
      env.Step(actions, result);
      agent.Observe(result);
      agent.Learn();
    }
  }
};

BenchCase RolloutCase(const PpoConfig& config, int threads) {
  const double steps = static_cast<double>(config.horizon) * kEnvs;
  const int obs_size = PendulumV1({}).spec().obs_size;
  return {fmt::format("ppo/{}/batch:{}/threads:{}", fmt::join(config.hidden, "-"), config.batch,
                      threads),
          "steps",
          steps,
          2 * steps * StepFlops(config, obs_size),
          0,
          threads,
          [=]() -> BenchWork {
            const auto parts = std::make_shared<Parts>(config, threads);
            return [=] { parts->Rollout(config.horizon); };
          }};
}

}  // namespace

BenchCases PpoCases(const BenchOptions& options) {
  const std::vector<int64_t> hidden =
      options.hidden.empty() ? std::vector<int64_t>{64, 64} : options.hidden;
  const PpoConfig config = BareConfig(hidden, options.batch > 0 ? options.batch : 256);
  BenchCases cases;
  for (const int64_t threads : options.threads) {
    cases.push_back(RolloutCase(config, static_cast<int>(threads)));
  }
  return cases;
}

}  // namespace upswing
