// Cases of `upswing bench` for learning: gradient, sac, ppo. Agents have no extensions, so that
// they are comparable with other libraries.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>

#include "pendulum/pendulum_env.h"
#include "pendulum/pendulum_v1.h"
#include "rl/dqn.h"
#include "rl/ppo.h"
#include "rl/sac.h"
#include "tools/bench/bench.h"

namespace upswing {
namespace {

using Widths = std::vector<int64_t>;  // widths of the hidden layers

/// Multiply-adds per row: of all layers, and of the first layer.
struct MultiplyAdds {
  explicit MultiplyAdds(const NetworkShape& shape)
      : all(Network(shape).multiply_adds()),
        first(static_cast<double>(shape.inputs) * shape.hidden.front()) {}
  double all, first;
};

template <typename AgentConfig>
std::string NameOf(std::string_view what, const AgentConfig& config, int threads) {
  return fmt::format("{}/{}/batch:{}/threads:{}", what, fmt::join(config.hidden, "-"), config.batch,
                     threads);
}

/// Case of an off-policy agent that samples a minibatch and learns from it.
template <typename Learner, typename LearnerConfig>
BenchCase UpdateCase(std::string_view what, const char* items, double flops,
                     const LearnerConfig& config, const EnvSpec& spec,
                     const std::shared_ptr<Replay>& replay, int threads) {
  struct Parts {
    BenchPool pool;
    Learner agent;
    Minibatch batch;
    Rng rng{1, "replay sampling"};
    Parts(const LearnerConfig& c, const EnvSpec& s, int pool_threads)
        : pool(pool_threads), agent(c, s, 1, pool), batch(static_cast<int>(c.batch), s.obs_size) {}
  };
  return {.name = NameOf(what, config, threads),
          .items = items,
          .flops = flops,
          .threads = threads,
          .prepare = [=]() -> BenchWork {
            const auto parts = std::make_shared<Parts>(config, spec, threads);
            return [=] {
              replay->Sample(parts->rng, parts->batch);
              parts->agent.Update(parts->batch);
            };
          }};
}

DqnConfig BareDqn(bool dueling, const Widths& hidden, int64_t batch) {
  DqnConfig config;
  config.hidden = hidden;
  config.head = std::max<int64_t>(1, config.hidden.back() / 2);
  config.layer_norm = false;
  config.dueling = config.double_q = dueling;
  config.batch = config.replay = batch;
  return config;
}

/// Operations of a gradient step: all forward passes, the gradients of all inputs except the
/// observations, and the gradients of all weights.
double UpdateFlops(const DqnConfig& config) {
  const MultiplyAdds network(config.Shape(kObservationSize, kBenchActions));
  const double forward = (config.double_q ? 3 : 2) * network.all;
  return 2 * static_cast<double>(config.batch) * (forward + 2 * network.all - network.first);
}

SacConfig BareSac(const Widths& hidden, int64_t batch) {
  SacConfig config;
  config.hidden = hidden;
  config.batch = batch;
  config.layer_norm = false;
  config.actor_period = 1;
  config.n_step = 1;
  config.mirror = false;
  config.policy_tau = 1;
  config.replay = 10000;
  return config;
}

/// Operations of a round. Each of two critics: forward at s' with the targets; forward and backward
/// at (s, a); forward and backward to the inputs, for the actor. Actor: forward at s', forward and
/// backward at s.
double RoundFlops(const SacConfig& config, const EnvSpec& spec) {
  const int D = spec.obs_size, A = spec.action_size();
  const MultiplyAdds critic(config.Shape(D + A, 1)), actor(config.Shape(D, 2 * A));
  const double critics = 2 * (6 * critic.all - critic.first);
  return 2 * static_cast<double>(config.batch) * (critics + 4 * actor.all - actor.first);
}

/// Settings with rollouts of about 4096 steps, a multiple of the minibatch, and two epochs.
PpoConfig BarePpo(const Widths& hidden, int64_t batch) {
  PpoConfig config;
  config.hidden = hidden;
  config.batch = batch;
  config.horizon = batch * std::max<int64_t>(1, 1024 / batch);
  config.epochs = 2;
  config.kl_target = 0;
  config.normalize = false;
  return config;
}

/// Operations of policy and value per step: the forward pass of the rollout, and forward, backward
/// and weight gradients in each epoch.
double StepFlops(const PpoConfig& config, int obs_size) {
  const MultiplyAdds network(config.Shape(obs_size, 1));
  const double epoch = 3 * network.all - network.first;
  return 4 * (network.all + static_cast<double>(config.epochs) * epoch);
}

/// Case of a rollout and the learning from it.
BenchCase RolloutCase(const PpoConfig& config, int threads) {
  constexpr int kEnvs = 4;
  struct Parts {
    BenchPool pool;
    PendulumV1 env{{kEnvs, 1, "benchmark"}};
    Ppo agent;
    StepResult result;
    std::vector<double> action = std::vector<double>(kEnvs);
    Parts(const PpoConfig& c, int pool_threads)
        : pool(pool_threads), agent(c, env.spec(), 1, pool), result(env.spec()) {}
  };
  const double steps = static_cast<double>(config.horizon) * kEnvs;
  return {.name = NameOf("ppo", config, threads),
          .items = "steps",
          .count = steps,
          .flops = steps * StepFlops(config, PendulumV1({}).spec().obs_size),
          .threads = threads,
          .prepare = [=]() -> BenchWork {
            const auto parts = std::make_shared<Parts>(config, threads);
            return [=] {
              auto& [pool, env, agent, result, action] = *parts;
              const Matrix<double> actions(action.data(), kEnvs, 1);
              for (int64_t t = 0; t < config.horizon; ++t) {
                agent.Act(env.obs(), actions);
                env.Step(actions, result);
                agent.Observe(result);
                agent.Learn();
              }
            };
          }};
}

}  // namespace

BenchCases GradientCases(const BenchOptions& options) {
  std::vector<Widths> networks{{64, 64}, {128, 128}, {256, 256}};
  if (!options.hidden.empty()) networks = {options.hidden};
  std::vector<int64_t> batches{32, 64, 128, 256};
  if (options.batch > 0) batches = {options.batch};

  const EnvSpec spec = PendulumSpec(PendulumEnvConfig());
  const auto replay = FilledReplay(100'000, spec.obs_size, ActionSpace::Discrete(kBenchActions));
  BenchCases cases;
  for (const bool dueling : {false, true}) {
    const std::string network = dueling ? "dueling" : "plain";
    if (!options.network.empty() && options.network != network) continue;
    for (const Widths& hidden : networks) {
      for (const int64_t batch : batches) {
        const DqnConfig config = BareDqn(dueling, hidden, batch);
        for (const int64_t threads : options.threads) {
          cases.push_back(UpdateCase<Dqn>("gradient/" + network, "updates", UpdateFlops(config),
                                          config, spec, replay, threads));
        }
      }
    }
  }
  return cases;
}

BenchCases SacCases(const BenchOptions& options) {
  std::vector<SacConfig> configs{BareSac({64, 64}, 100), BareSac({256, 256}, 256)};
  if (!options.hidden.empty() || options.batch > 0) {
    configs = {BareSac(options.hidden.empty() ? Widths{64, 64} : options.hidden,
                       options.batch > 0 ? options.batch : 100)};
  }
  const EnvSpec spec = PendulumV1({}).spec();
  const auto replay = FilledReplay(configs.front().replay, spec.obs_size, ActionSpace{1});
  BenchCases cases;
  for (const SacConfig& config : configs) {
    for (const int64_t threads : options.threads) {
      cases.push_back(UpdateCase<Sac>("sac", "rounds", RoundFlops(config, spec), config, spec,
                                      replay, threads));
    }
  }
  return cases;
}

BenchCases PpoCases(const BenchOptions& options) {
  const PpoConfig config = BarePpo(options.hidden.empty() ? Widths{64, 64} : options.hidden,
                                   options.batch > 0 ? options.batch : 256);
  BenchCases cases;
  for (const int64_t threads : options.threads) {
    cases.push_back(RolloutCase(config, threads));
  }
  return cases;
}

}  // namespace upswing
