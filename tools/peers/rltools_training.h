#pragma once

// Common parts of RLtools' SAC and PPO: Pendulum-v1, a clock, an evaluation, one JSON line.
// rltools_actor.py compiles this file and defines the numbers in capital letters.

#include <rl_tools/operations/cpu_mux.h>
// RLtools needs its headers in this order, all of them before the first use.
// clang-format off
#include <rl_tools/nn/optimizers/adam/instance/operations_generic.h>
#include <rl_tools/nn/operations_cpu_mux.h>
#include <rl_tools/nn/layers/sample_and_squash/operations_generic.h>
#include <rl_tools/nn/layers/standardize/operations_generic.h>
#include <rl_tools/rl/environments/pendulum/operations_cpu.h>
#include <rl_tools/nn_models/mlp_unconditional_stddev/operations_generic.h>
#include <rl_tools/nn_models/mlp/operations_generic.h>
#include <rl_tools/nn_models/sequential/operations_generic.h>
#include <rl_tools/nn/optimizers/adam/operations_generic.h>
#include <rl_tools/rl/algorithms/ppo/loop/core/config.h>
#include <rl_tools/rl/algorithms/ppo/loop/core/operations_generic.h>
#include <rl_tools/rl/algorithms/sac/loop/core/config.h>
#include <rl_tools/rl/algorithms/sac/loop/core/operations_generic.h>
#include <rl_tools/rl/loop/steps/evaluation/config.h>
#include <rl_tools/rl/loop/steps/evaluation/operations_generic.h>
// clang-format on

#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <memory>
#include <string>

namespace rlt = rl_tools;

using Device = rlt::devices::DEVICE_FACTORY<>;
using Index = Device::index_t;
using Random = Device::SPEC::RANDOM::ENGINE<>;
using Numbers = rlt::numeric_types::Policy<float>;
using Pendulum =
    rlt::rl::environments::Pendulum<rlt::rl::environments::pendulum::Specification<float, Index>>;

/// More loop steps than in any training.
inline constexpr Index kNoLimit = Index{1} << 40;

/// Adam with RLtools' defaults, except for the learning rate.
struct AdamParameters : rlt::nn::optimizers::adam::DEFAULT_PARAMETERS_TENSORFLOW<Numbers> {
  static constexpr float ALPHA = PEER_LEARNING_RATE;
};

/// Wall-clock and CPU time (s) of this process.
struct Time {
  static Time Now() {
    timespec cpu{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
    const auto wall = std::chrono::steady_clock::now().time_since_epoch();
    return {std::chrono::duration<double>(wall).count(),
            static_cast<double>(cpu.tv_sec) + 1e-9 * static_cast<double>(cpu.tv_nsec)};
  }
  double wall, cpu;
};

/// The mean return of the mean actions, over PEER_EPISODES episodes.
template <class State>
double MeanReturn(Device& device, State& state) {
  using Spec = rlt::rl::utils::evaluation::Specification<Numbers, Index, Pendulum, PEER_EPISODES,
                                                         Pendulum::EPISODE_STEP_LIMIT>;
  rlt::rl::utils::evaluation::Result<Spec> result;
  Pendulum env;
  rlt::rl::environments::DummyUI no_window;
  rlt::Mode<rlt::mode::Evaluation<>> mode;
  rlt::evaluate(device, env, no_window, rlt::get_actor(state), result, state.rng, mode);
  return static_cast<double>(result.returns_mean);
}

/// Trains, and prints rates and mean return as one JSON line. Arguments: seed, number of steps that
/// the clock leaves out, total number of steps. A loop step makes `steps_per_loop` steps.
template <class State>
int Train(char** arguments, Index steps_per_loop) {
  const auto [seed, unclocked, steps] =
      std::array{std::stoul(arguments[1]), std::stoul(arguments[2]), std::stoul(arguments[3])};
  Device device;
  rlt::init(device);
  const auto state = std::make_unique<State>();
  rlt::malloc(device, *state);
  rlt::init(device, *state, seed);
  while (state->step < unclocked / steps_per_loop) rlt::step(device, *state);
  const Time begin = Time::Now();
  while (state->step < steps / steps_per_loop) rlt::step(device, *state);
  const Time end = Time::Now();

  const auto counted = static_cast<double>(steps - unclocked);
  const double rate = counted / (end.wall - begin.wall);
  std::printf(
      "{\"steps_per_second\": %.9g, \"cpu_seconds_per_step\": %.9g, \"seconds\": %.9g, "
      "\"mean_return\": %.9g}\n",
      rate, (end.cpu - begin.cpu) / counted, static_cast<double>(steps) / rate,
      MeanReturn(device, *state));
  return 0;
}
