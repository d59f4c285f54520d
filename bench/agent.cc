// Cases of `upswing bench` for the agent: gradient, act, replay, train.
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "bench/bench.h"
#include "core/rng.h"
#include "mujoco/engines.h"
#include "nn/network_policy.h"
#include "rl/dqn.h"
#include "rl/replay.h"
#include "rl/torque_levels.h"
#include "run/config_files.h"
#include "run/this_host.h"
#include "setup/config.h"
#include "setup/training.h"

namespace upswing {
namespace {

constexpr int kActions = 9;

/// What the agent of a case learns.
EnvSpec OneEnvironment() { return PendulumSpec(PendulumEnvConfig()); }

/// Multiply-adds that each layer of a network takes for one row, the first layer first.
std::vector<double> LayerMultiplyAdds(const NetworkShape& shape) {
  const Network network(shape);
  std::vector<double> layers;
  for (const ParameterBlock& block : network.blocks()) {
    if (block.in > 0) layers.push_back(static_cast<double>(block.in) * block.out);
  }
  return layers;
}

double Sum(const std::vector<double>& numbers) {
  double sum = 0;
  for (const double x : numbers) sum += x;
  return sum;
}

/// The network of a gradient case: in its bare form, without layer normalisation.
DqnConfig BareConfig(bool dueling, const std::vector<int64_t>& hidden, int64_t batch) {
  DqnConfig config;
  config.hidden = hidden;
  config.head = std::max<int64_t>(1, config.hidden.back() / 2);
  config.layer_norm = false;
  config.dueling = config.double_q = dueling;
  config.batch = config.replay = batch;
  return config;
}

/// Operations of a gradient step: all forward passes, the gradients of all inputs but the
/// observations, the gradients of all weights.
double UpdateFlops(const DqnConfig& config) {
  const std::vector<double> layers = LayerMultiplyAdds(config.Shape(kObservationSize, kActions));
  const double all = Sum(layers);
  const double forward = (config.double_q ? 3 : 2) * all;
  return 2 * static_cast<double>(config.batch) * (forward + (all - layers.front()) + all);
}

/// Gradient steps: a minibatch is sampled and learned from.
BenchCase GradientCase(const DqnConfig& config, int threads,
                       const std::shared_ptr<Replay>& replay) {
  const std::string name =
      fmt::format("gradient/{}/{}/batch:{}/threads:{}", config.dueling ? "dueling" : "plain",
                  fmt::join(config.hidden, "-"), config.batch, threads);
  return {name, "updates", 1, UpdateFlops(config), 0, threads, [=]() -> BenchWork {
            struct Parts {
              BenchPool pool;
              Dqn agent;
              Minibatch batch;
              Rng rng{1, "replay sampling"};
              Parts(const DqnConfig& c, int pool_threads)
                  : pool(pool_threads),
                    agent(c, OneEnvironment(), 1, pool),
                    batch(static_cast<int>(c.batch), kObservationSize) {}
            };
            const auto parts = std::make_shared<Parts>(config, threads);
            return [parts, replay] {
              replay->Sample(parts->rng, parts->batch);
              parts->agent.Update(parts->batch);
            };
          }};
}

BenchCase ActCase(int batch) {
  const NetworkShape shape = BareConfig(true, {256, 256}, batch).Shape(kObservationSize, kActions);
  // The value stream is left out: half of the streams' hidden layer, and the value.
  const std::vector<double> layers = LayerMultiplyAdds(shape);
  const double multiply_adds = layers[0] + layers[1] + layers[2] / 2 + layers[4];
  return {
      fmt::format("act/256-256/batch:{}", batch),
      "actions",
      static_cast<double>(batch),
      2.0 * multiply_adds * batch,
      0,
      1,
      [=]() -> BenchWork {
        Rng rng(1, "benchmark");
        NetworkPolicyParts parts{ActionRule::kLevels, shape};
        const Network network(shape);
        parts.parameters.resize(network.num_parameters());
        network.Initialize(rng, parts.parameters);
        parts.torques = TorqueLevels(Plant().torque_limit, kActions);
        const auto policy = std::make_shared<NetworkPolicy>(std::move(parts), PolicyInfo());
        const auto n = static_cast<size_t>(batch);
        const auto obs = std::make_shared<AlignedVector<float>>(n * kObservationSize);
        for (float& x : *obs) x = static_cast<float>(rng.Uniform(-1, 1));
        const auto torque = std::make_shared<std::vector<double>>(n);
        const std::shared_ptr<Policy::Memory> memory = policy->Start(batch);
        return [=] {
          policy->Act({obs->data(), batch, kObservationSize}, {torque->data(), batch, 1}, *memory);
        };
      }};
}

BenchCase TrainCase(const std::string& agent, const std::string& physics, int threads) {
  // Without evaluations.
  const Config config = BuildConfig({}, {{"agent", agent},
                                         {"physics", physics},
                                         {"steps", "1000000000"},
                                         {"threads", std::to_string(threads)},
                                         {"eval_every", "1000000000"}});
  return {fmt::format("train/{}/{}/threads:{}", agent, physics, threads),
          "steps",
          static_cast<double>(config.train.envs),
          0,
          0,
          threads,
          [=]() -> BenchWork {
            const auto training =
                std::make_shared<Training>(config, ThisHost(ResolveThreads(threads)));
            while (training->agent().updates() == 0) training->Step();
            return [training] { training->Step(); };
          }};
}

}  // namespace

std::shared_ptr<Replay> FilledReplay(int64_t size, int obs_size, const ActionSpace& actions) {
  Rng rng(1, "benchmark");
  auto replay = std::make_shared<Replay>(size, obs_size, actions);
  std::vector<float> obs(obs_size), next_obs(obs_size), action(actions.size);
  for (int64_t i = 0; i < size; ++i) {
    for (float& x : obs) x = static_cast<float>(rng.Uniform(-1, 1));
    for (float& x : next_obs) x = static_cast<float>(rng.Uniform(-1, 1));
    for (float& a : action) {
      a = actions.whole ? static_cast<float>(rng.Below(kActions))
                        : static_cast<float>(rng.Uniform(-1, 1));
    }
    replay->Add({obs, next_obs, action, static_cast<float>(rng.Uniform(-1, 1)),
                 rng.Uniform() < 0.02 ? 0.0F : 0.99F});
  }
  return replay;
}

BenchCases GradientCases(const BenchOptions& options) {
  std::vector<std::vector<int64_t>> networks{{64, 64}, {128, 128}, {256, 256}};
  if (!options.hidden.empty()) networks = {options.hidden};
  std::vector<int64_t> batches{32, 64, 128, 256};
  if (options.batch > 0) batches = {options.batch};

  const std::shared_ptr<Replay> replay =
      FilledReplay(100'000, kObservationSize, ActionSpace::Discrete(kActions));
  BenchCases cases;
  for (const bool dueling : {false, true}) {
    if (!options.network.empty() && (options.network == "dueling") != dueling) continue;
    for (const std::vector<int64_t>& hidden : networks) {
      for (const int64_t batch : batches) {
        for (const int64_t threads : options.threads) {
          cases.push_back(GradientCase(BareConfig(dueling, hidden, batch), threads, replay));
        }
      }
    }
  }
  return cases;
}

BenchCases ActCases(const BenchOptions& /*options*/) {
  return {ActCase(1), ActCase(8), ActCase(100)};
}

BenchCases ReplayCases(const BenchOptions& /*options*/) {
  constexpr int kBatch = 128;
  constexpr int64_t kStored = 300'000;
  const auto sample = [=]() -> BenchWork {
    const std::shared_ptr<Replay> replay =
        FilledReplay(kStored, kObservationSize, ActionSpace::Discrete(kActions));
    const auto batch = std::make_shared<Minibatch>(kBatch, kObservationSize);
    const auto rng = std::make_shared<Rng>(1, "replay sampling");
    return [=] { replay->Sample(*rng, *batch); };
  };
  const auto add = [=]() -> BenchWork {
    const std::shared_ptr<Replay> replay =
        FilledReplay(kStored, kObservationSize, ActionSpace::Discrete(kActions));
    const std::vector<float> obs(kObservationSize, 0.5F), action{1};
    return [=] {
      for (int i = 0; i < kBatch; ++i) replay->Add({obs, obs, action, 0.5F, 0.99F});
    };
  };
  return {{fmt::format("replay/sample/batch:{}", kBatch), "transitions", kBatch, 0, 0, 1, sample},
          {fmt::format("replay/add/batch:{}", kBatch), "transitions", kBatch, 0, 0, 1, add}};
}

BenchCases TrainCases(const BenchOptions& options) {
  BenchCases cases;
  for (const std::string agent : {"d3qn", "d3qn-small"}) {
    for (const std::string& physics : EngineNames()) {
      for (const int64_t threads : options.threads) {
        cases.push_back(TrainCase(agent, physics, threads));
      }
    }
  }
  return cases;
}

}  // namespace upswing
