#include "rl/sac.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>

#include "bench/bench.h"
#include "sim/pendulum_v1.h"

namespace upswing {
namespace {

/// What peers of this benchmark learn: Pendulum-v1.
EnvSpec OneEnvironment() { return PendulumV1({}).spec(); }

/// SAC in its common form: no layer normalisation, an actor's step in each round.
SacConfig BareConfig(const std::vector<int64_t>& hidden, int64_t batch) {
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

/// Multiply-adds for one row: of all layers, and of the first.
struct MultiplyAdds {
  explicit MultiplyAdds(const NetworkShape& shape)
      : all(Network(shape).multiply_adds()),
        first(static_cast<double>(shape.inputs) * shape.hidden.front()) {}
  double all, first;
};

/// Operations of a round. Critics, two each: at s' with the targets, forward and backward at s, a;
/// forward and backward to the inputs for the actor. Actor: at s', forward and backward at s.
double RoundFlops(const SacConfig& config, const EnvSpec& spec) {
  const int D = spec.obs_size, A = spec.action_size();
  const MultiplyAdds critic(config.Shape(D + A, 1)), actor(config.Shape(D, 2 * A));
  const double critics = 2 * (6 * critic.all - critic.first);
  return 2 * static_cast<double>(config.batch) * (critics + 4 * actor.all - actor.first);
}

BenchCase RoundCase(const std::vector<int64_t>& hidden, int64_t batch, int threads) {
  const SacConfig config = BareConfig(hidden, batch);
  return {fmt::format("sac/{}/batch:{}/threads:{}", fmt::join(hidden, "-"), batch, threads),
          "rounds",
          1,
          RoundFlops(config, OneEnvironment()),
          0,
          threads,
          [=]() -> BenchWork {
            struct Parts {
              BenchPool pool;
              Sac agent;
              std::shared_ptr<Replay> replay;
              Minibatch batch;
              Rng rng{1, "replay sampling"};
              Parts(const SacConfig& c, int pool_threads)
                  : pool(pool_threads),
                    agent(c, OneEnvironment(), 1, pool),
                    replay(FilledReplay(c.replay, OneEnvironment().obs_size, ActionSpace{1})),
                    batch(static_cast<int>(c.batch), OneEnvironment().obs_size) {}
            };
            const auto parts = std::make_shared<Parts>(config, threads);
            return [parts] {
              parts->replay->Sample(parts->rng, parts->batch);
              parts->agent.Update(parts->batch);
            };
          }};
}

}  // namespace

BenchCases SacCases(const BenchOptions& options) {
  std::vector<std::pair<std::vector<int64_t>, int64_t>> sizes{{{64, 64}, 100}, {{256, 256}, 256}};
  if (!options.hidden.empty() || options.batch > 0) {
    const std::vector<int64_t> hidden =
        options.hidden.empty() ? std::vector<int64_t>{64, 64} : options.hidden;
    sizes = {{hidden, options.batch > 0 ? options.batch : 100}};
  }
  BenchCases cases;
  for (const auto& [hidden, batch] : sizes) {
    for (const int64_t threads : options.threads) {
      cases.push_back(RoundCase(hidden, batch, static_cast<int>(threads)));
    }
  }
  return cases;
}

}  // namespace upswing
