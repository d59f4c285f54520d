// Cases of `upswing bench` for an agent and its parts: act, replay, train.
#include <fmt/format.h>

#include <memory>

#include "agents/config.h"
#include "agents/training.h"
#include "base/rng.h"
#include "mujoco/engines.h"
#include "nn/network_policy.h"
#include "rl/replay.h"
#include "rl/torque_levels.h"
#include "runs/config_files.h"
#include "runs/this_host.h"
#include "tools/bench/bench.h"

namespace upswing {
namespace {

BenchCase ActCase(int batch) {
  constexpr int kHidden = 256, kStream = 128;
  const NetworkShape shape{
      kObservationSize, {kHidden, kHidden}, kBenchActions, false, Activation::kRelu, kStream};
  // Acting skips the value stream: half of the streams' hidden layer, and the value layer.
  const double multiply_adds = Network(shape).multiply_adds() - kStream * (kHidden + 1);
  return {
      .name = fmt::format("act/{0}-{0}/batch:{1}", kHidden, batch),
      .items = "actions",
      .count = static_cast<double>(batch),
      .flops = 2.0 * multiply_adds * batch,
      .prepare = [=]() -> BenchWork {
        Rng rng(1, "benchmark");
        NetworkPolicyParts parts{ActionRule::kLevels, shape};
        const Network network(shape);
        parts.parameters.resize(network.num_parameters());
        network.Initialize(rng, parts.parameters);
        parts.torques = TorqueLevels(Plant().torque_limit, kBenchActions);
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
  // Settings without evaluations.
  const Config config = BuildConfig({}, {{"agent", agent},
                                         {"physics", physics},
                                         {"steps", "1000000000"},
                                         {"threads", std::to_string(threads)},
                                         {"eval_every", "1000000000"}});
  return {.name = fmt::format("train/{}/{}/threads:{}", agent, physics, threads),
          .items = "steps",
          .count = static_cast<double>(config.train.envs),
          .threads = threads,
          .prepare = [=]() -> BenchWork {
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
      a = actions.whole ? static_cast<float>(rng.Below(kBenchActions))
                        : static_cast<float>(rng.Uniform(-1, 1));
    }
    replay->Add({obs, next_obs, action, static_cast<float>(rng.Uniform(-1, 1)),
                 rng.Uniform() < 0.02 ? 0.0F : 0.99F});
  }
  return replay;
}

BenchCases ActCases(const BenchOptions& /*options*/) {
  return {ActCase(1), ActCase(8), ActCase(100)};
}

BenchCases ReplayCases(const BenchOptions& /*options*/) {
  constexpr int kBatch = 128;
  const auto filled = [] {
    return FilledReplay(300'000, kObservationSize, ActionSpace::Discrete(kBenchActions));
  };
  const auto sample = [=]() -> BenchWork {
    const auto batch = std::make_shared<Minibatch>(kBatch, kObservationSize);
    const auto rng = std::make_shared<Rng>(1, "replay sampling");
    return [=, replay = filled()] { replay->Sample(*rng, *batch); };
  };
  const auto add = [=]() -> BenchWork {
    const std::vector<float> obs(kObservationSize, 0.5F), action{1};
    return [=, replay = filled()] {
      for (int i = 0; i < kBatch; ++i) replay->Add({obs, obs, action, 0.5F, 0.99F});
    };
  };
  return {{.name = fmt::format("replay/sample/batch:{}", kBatch),
           .items = "transitions",
           .count = kBatch,
           .prepare = sample},
          {.name = fmt::format("replay/add/batch:{}", kBatch),
           .items = "transitions",
           .count = kBatch,
           .prepare = add}};
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
