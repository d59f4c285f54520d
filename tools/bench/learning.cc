// Cases of `upswing bench gradient`. The agent has no extensions, so that it is comparable with
// other libraries.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>

#include "base/rng.h"
#include "base/thread_pool.h"
#include "pendulum/pendulum_env.h"
#include "rl/dqn.h"
#include "rl/replay.h"
#include "tools/bench/bench.h"

namespace upswing {
namespace {

using Widths = std::vector<int64_t>;  // widths of the hidden layers

DqnConfig BareDqn(bool dueling, const Widths& hidden, int64_t batch) {
  DqnConfig config;
  config.hidden = hidden;
  config.head = std::max<int64_t>(1, config.hidden.back() / 2);
  config.layer_norm = false;
  config.dueling = config.double_q = dueling;
  config.batch = config.replay = batch;
  return config;
}

/// A replay memory with `size` random transitions, 2% of which terminate.
std::shared_ptr<Replay> FilledReplay(int64_t size) {
  Rng rng(1, "benchmark");
  auto replay =
      std::make_shared<Replay>(size, kObservationSize, ActionSpace::Discrete(kBenchActions));
  std::vector<float> obs(kObservationSize), next_obs(kObservationSize), action(1);
  for (int64_t i = 0; i < size; ++i) {
    for (float& x : obs) x = static_cast<float>(rng.Uniform(-1, 1));
    for (float& x : next_obs) x = static_cast<float>(rng.Uniform(-1, 1));
    action[0] = static_cast<float>(rng.Below(kBenchActions));
    replay->Add({obs, next_obs, action, static_cast<float>(rng.Uniform(-1, 1)),
                 rng.Uniform() < 0.02 ? 0.0F : 0.99F});
  }
  return replay;
}

/// Case of an agent that samples a minibatch and learns from it.
BenchCase GradientCase(const DqnConfig& config, const std::shared_ptr<Replay>& replay,
                       int threads) {
  struct Parts {
    ThreadPool pool;
    Dqn agent;
    Minibatch batch;
    Rng rng{1, "replay sampling"};
    Parts(const DqnConfig& c, int pool_threads)
        : pool(pool_threads),
          agent(c, PendulumSpec(PendulumEnvConfig()), 1, pool),
          batch(static_cast<int>(c.batch), kObservationSize) {}
  };
  return {.name = fmt::format("gradient/{}/{}/batch:{}/threads:{}",
                              config.dueling ? "dueling" : "plain", fmt::join(config.hidden, "-"),
                              config.batch, threads),
          .prepare = [=]() -> BenchWork {
            const auto parts = std::make_shared<Parts>(config, threads);
            return [=] {
              replay->Sample(parts->rng, parts->batch);
              parts->agent.Update(parts->batch);
            };
          }};
}

}  // namespace

BenchCases GradientCases(const BenchOptions& options) {
  std::vector<Widths> networks{{64, 64}, {128, 128}, {256, 256}};
  if (!options.hidden.empty()) networks = {options.hidden};
  std::vector<int64_t> batches{32, 64, 128, 256};
  if (options.batch > 0) batches = {options.batch};

  const auto replay = FilledReplay(100'000);
  BenchCases cases;
  for (const bool dueling : {false, true}) {
    for (const Widths& hidden : networks) {
      for (const int64_t batch : batches) {
        for (const int64_t threads : options.threads) {
          cases.push_back(
              GradientCase(BareDqn(dueling, hidden, batch), replay, static_cast<int>(threads)));
        }
      }
    }
  }
  return cases;
}

}  // namespace upswing
