// Dueling Double DQN on one page: learns to swing up and balance a double pendulum, as in the post
// "Balancing a Double Pendulum with DQN and MuJoCo". The library provides the pendulum, the network
// with its gradient, and Adam. Everything that makes them DQN is in this file.
//
//     dqn_on_one_page [--seed N]     exit code 0: it balances; 1: it does not; 2: bad usage
//
// Symbols, with shapes and units:
//   N, B, E    environments, transitions in a minibatch, evaluation episodes
//   D, A, P    numbers in an observation, actions, parameters of the network
//   q1, q2     joint angles, rad; both are 0 when hanging, and q2 is relative to link 1
//   w1, w2     their velocities, rad/s
//   s, s'      observation before and after a step (D): [cos q1, sin q1, w1/10, cos q2, sin q2,
//              w2/20, energy (0 hanging, 1 upright), height of the tip (-1 to 1)]
//   a, u       index of a torque (0 … A-1), and the torque of joint 1, N·m
//   r          reward of one step, times kRewardScale
//   γ, ε       discount per step of 0.02 s, share of random actions
//   θ, θ⁻      online and target parameters (P)
//   Q(s, a; θ) action value: expected discounted sum of rewards
//   y, δ       TD target (B), TD error Q(s, a; θ) - y (B)
//   τ          share of the way that θ⁻ moves towards θ in each update
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <vector>

#include "base/argmax.h"
#include "base/error.h"
#include "base/options.h"
#include "base/rng.h"
#include "nn/adam.h"
#include "nn/network.h"
#include "pendulum/pendulum_env.h"

using namespace upswing;

// Torques, dueling streams, Polyak averaging and the decay of ε per episode are from the post. The
// sizes and rates are ours: the post has 256-256 units and streams of 128.
constexpr int D = kObservationSize, A = 9, B = 128, E = 20;
constexpr std::array<double, A> kTorque = {-5, -3.75, -2.5, -1.25, 0, 1.25, 2.5, 3.75, 5};  // N·m
constexpr int kHidden = 64, kStream = 32;  // units of both hidden layers, and of each stream
constexpr float kGamma = 0.98F;
constexpr double kTau = 0.025, kEpsilonDecay = 0.977, kEpsilonEnd = 0.05;
constexpr size_t kCapacity = 100'000, kLearningStarts = 2'000;  // transitions
constexpr int kEvaluateEvery = 10'000, kMaxSteps = 400'000;     // steps of all environments

// Ours, to learn in seconds:
constexpr int N = 32;                    // environments that step together
constexpr int kUpdates = 2;              // gradient steps for each step of all N environments
constexpr double kRandomStarts = 0.9;    // share of episodes from random states, not from hanging
constexpr double kEpisodeSeconds = 4;    // short episodes, so that starts vary more
constexpr double kRewardScale = 0.1;     // scaled rewards are at most 0.75
constexpr bool kLayerNorm = true;        // hidden layers have layer normalisation
constexpr double kMirrored = 0.5;        // share of a minibatch that is mirrored
constexpr double kMaxGradientNorm = 10;  // a longer gradient is scaled down to this norm
constexpr double kLearningRate = 2e-3, kLearningRateEnd = 2e-4;  // linear in between,
constexpr double kLearningRateSteps = 200'000;                   // over this number of steps

/// A table of rows × cols numbers, all 0 at first.
struct Table {
  int rows, cols;
  AlignedVector<float> numbers = AlignedVector<float>(size_t(rows) * size_t(cols));
  Matrix<float> view() { return {numbers.data(), rows, cols}; }
  float& operator()(int i, int j) { return view()(i, j); }
  std::span<float> row(int i) { return view().row(i); }
};

struct Transition {
  std::array<float, D> s, s_next;
  int a;
  float r;
  bool terminated;  // whether s' has no future; an episode that runs out of time has one
};

/// The mirror image of a transition: angles, velocities and torques change sign, the reward stays.
Transition Mirrored(Transition t) {
  for (const int k : {1, 2, 4, 5}) {  // sin q1, w1, sin q2, w2
    t.s[k] = -t.s[k];
    t.s_next[k] = -t.s_next[k];
  }
  t.a = A - 1 - t.a;
  return t;
}

/// Replay memory of the newest kCapacity transitions: a ring buffer.
struct Replay {
  std::vector<Transition> ring;
  size_t added = 0;

  void Add(const Transition& t) {
    if (ring.size() < kCapacity) ring.emplace_back();
    ring[added++ % kCapacity] = t;
  }
  const Transition& Sample(Rng& rng) const { return ring[rng.Below(ring.size())]; }  // uniform
};

/// Dueling Double DQN.
class Agent {
 public:
  explicit Agent(uint64_t seed) : rng_(seed, "agent") {
    network_.Initialize(rng_, theta_);
    theta_target_ = theta_;
  }

  /// Q(s, ·; θ) for each row of s (… × D): a table (… × A). The network's hidden layers end in a
  /// value stream V(s) and an advantage stream A(s, a). It adds them as (Wang et al., 2016, Eq 9)
  ///     Q(s, a) = V(s) + A(s, a) - mean_a' A(s, a').
  Table Q(std::span<const float> theta, Matrix<const float> s) {
    Table q{s.rows(), A};
    network_.Forward(theta, s, {0, s.rows()}, activations_, q.view());
    return q;
  }

  /// ε-greedy actions a, one for each row of s (… × D): random with probability ε, else
  /// argmax_a Q(s, a; θ). Writes their torques u.
  std::vector<int> Act(Matrix<const float> s, double epsilon, std::vector<double>& u) {
    Table q = Q(theta_, s);
    std::vector<int> a(u.size());
    for (size_t i = 0; i < u.size(); ++i) {
      a[i] = rng_.Uniform() < epsilon ? int(rng_.Below(A)) : ArgMax(q.row(i));
      u[i] = kTorque[a[i]];
    }
    return a;
  }

  /// Makes one gradient step on a minibatch.
  void Update(const Replay& replay, double learning_rate) {
    std::vector<Transition> batch;
    Table s{B, D}, s_next{B, D};
    for (int i = 0; i < B; ++i) {
      const Transition& t = replay.Sample(rng_);
      batch.push_back(rng_.Uniform() < kMirrored ? Mirrored(t) : t);
      std::ranges::copy(batch[i].s, s.row(i).begin());
      std::ranges::copy(batch[i].s_next, s_next.row(i).begin());
    }

    Table q_online = Q(theta_, s_next.view());         // Q(s', ·; θ)
    Table q_target = Q(theta_target_, s_next.view());  // Q(s', ·; θ⁻)
    Table q = Q(theta_, s.view());  // Q(s, ·; θ), last: Backward needs its activations
    Table dq{B, A};                 // ∂L/∂Q(s, ·; θ)
    for (int i = 0; i < B; ++i) {
      const Transition& t = batch[i];
      // Double DQN (van Hasselt et al., 2016, Eq 4): θ selects the action, θ⁻ evaluates it.
      //     y = r + γ Q(s', argmax_a Q(s', a; θ); θ⁻), or y = r after a termination
      const float future = q_target(i, ArgMax(q_online.row(i)));
      const float y = t.r + (t.terminated ? 0 : kGamma * future);
      // Mean Huber loss L = 1/B Σ H(δ), where H(δ) = δ²/2 if |δ| ≤ 1, else |δ| - 1/2. Hence
      //     ∂L/∂Q(s, a; θ) = clip(δ, -1, 1) / B
      const float delta = q(i, t.a) - y;
      dq(i, t.a) = std::clamp(delta, -1.0F, 1.0F) / B;
    }
    network_.Backward(theta_, s.view(), activations_, dq.view(), gradient_);

    // Adam moves θ. Then the target network follows: θ⁻ ← θ⁻ + τ (θ - θ⁻).
    double squares = 0;
    for (const float g : gradient_) squares += g * g;
    adam_.Step({learning_rate, std::sqrt(squares), kMaxGradientNorm, kTau}, gradient_, theta_,
               theta_target_, pool_);
  }

 private:
  Network network_{{D, {kHidden, kHidden}, A, kLayerNorm, Activation::kRelu, kStream}};
  AlignedVector<float> theta_ = AlignedVector<float>(network_.num_parameters());  // θ (P)
  AlignedVector<float> theta_target_, gradient_ = theta_;  // θ⁻, ∂L/∂θ (P)
  Adam adam_{theta_.size()};
  Network::Activations activations_ = network_.MakeActivations(std::max({N, B, E}), true);
  ThreadPool pool_{1};
  Rng rng_;
};

/// Plays E episodes of 20 s from hanging, without random actions. Returns the share of episodes
/// that have both links within 30° of straight up throughout the last 10 s.
double SuccessRate(Agent& agent, uint64_t seed) {
  PendulumEnvConfig config;
  config.num_envs = E;
  config.seed = seed;
  config.stream = "evaluation";  // other starts than in the training
  PendulumEnv env(config);
  const EnvSpec& spec = env.spec();
  const long steps = std::lround(spec.evaluation.seconds / spec.step_seconds);
  const long hold = std::lround(spec.evaluation.hold_seconds / spec.step_seconds);
  StepResult result = env.MakeResult();
  std::vector<double> u(E);
  std::vector<int> success(E, 1);
  for (long t = 0; t < steps; ++t) {
    agent.Act(env.obs(), 0, u);
    env.Step(u, result);
    for (int i = 0; i < E; ++i) {
      if (result.terminated[i] || (t >= steps - hold && !result.at_goal[i])) success[i] = 0;
    }
  }
  return double(std::ranges::count(success, 1)) / E;
}

/// Trains until an evaluation passes. Returns whether one did.
bool Train(uint64_t seed) {
  PendulumEnvConfig config;
  config.num_envs = N;
  config.seed = seed;
  config.episode_seconds = kEpisodeSeconds;
  config.start.random_share = kRandomStarts;
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  Agent agent(seed);
  Replay replay;
  std::vector<double> u(N);
  double epsilon = 1;
  for (int steps = N; steps <= kMaxSteps; steps += N) {
    // Act and remember. result.next_obs is s', env.obs() may be the start of a new episode.
    Table s{N, D};
    std::ranges::copy(env.obs().values(), s.numbers.begin());
    const std::vector<int> a = agent.Act(s.view(), epsilon, u);
    env.Step(u, result);
    for (int i = 0; i < N; ++i) {
      Transition t{{}, {}, a[i], float(kRewardScale * result.reward[i]), result.terminated[i] != 0};
      std::ranges::copy(s.row(i), t.s.begin());
      std::copy_n(&result.next_obs[i * D], D, t.s_next.begin());
      replay.Add(t);
      if (result.done(i)) epsilon = std::max(kEpsilonEnd, kEpsilonDecay * epsilon);
    }
    const double progress = std::min(1.0, steps / kLearningRateSteps);
    const double learning_rate = std::lerp(kLearningRate, kLearningRateEnd, progress);
    for (int k = 0; k < kUpdates && replay.ring.size() >= kLearningStarts; ++k) {
      agent.Update(replay, learning_rate);
    }
    if (steps % kEvaluateEvery >= N) continue;
    const double success = SuccessRate(agent, seed);
    std::printf("%7d steps  ε %.2f  success %3.0f%%\n", steps, epsilon, 100 * success);
    if (env.spec().evaluation.Passed(success, 0)) {
      std::printf("balances: %d of %d episodes after %d steps.\n", E, E, steps);
      return true;
    }
  }
  std::printf("does not balance after %d steps.\n", kMaxSteps);
  return false;
}

int main(int argc, char** argv) try {
  int64_t seed = 1;
  Options options;
  Option& option = options.Add(&seed, "seed", {0, 9e15}, "", "seed of all random numbers");
  const bool usage = argc == 1 || (argc == 3 && std::string_view(argv[1]) == "--seed");
  if (!usage) throw BadInput("expected no arguments or --seed N");
  if (argc == 3) option.Set(argv[2], "--seed");
  return Train(seed) ? 0 : 1;
} catch (const Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return error.exit_code();
}
