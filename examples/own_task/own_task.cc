// Your own task, learned with DQN using only the layers core, nn and rl: move a cart on a rail to
// the middle and hold it there.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "base/env.h"
#include "base/error.h"
#include "base/rng.h"
#include "base/thread_pool.h"
#include "rl/dqn.h"
#include "rl/evaluate.h"
#include "rl/trainer.h"

using namespace upswing;

/// N carts of 1 kg, each with position x (m), velocity v (m/s) and a motor of ±1 N. An episode
/// begins anywhere within ±1 m, at rest, and is truncated after 8 s. A cart that leaves ±2 m has
/// crashed. The reward of a step is 1 - |x| - 0.1 v²; a crash costs 20.
class CartEnv : public VectorEnv {
 public:
  static constexpr double kStep = 0.1;             // s; a force is held for this time
  static constexpr int kEpisodeSteps = 80;         // 8 s
  static constexpr double kRail = 2, kGoal = 0.2;  // m

  CartEnv(int num_envs, uint64_t seed) : rng_(seed, "cart"), carts_(size_t(num_envs)) {
    spec_.task = "cart";
    spec_.num_envs = num_envs;
    spec_.obs_size = 2;  // x, v
    spec_.action_limit = {1};
    spec_.action_unit = std::string("N");  // g++ 12 warns of a bare "N"
    spec_.step_seconds = kStep;
    spec_.term_names = {"position", "velocity", "crash"};
    spec_.state_names = {"x", "v"};
    spec_.state_units = {"m", "m/s"};
    spec_.mirror_signs = {-1, -1};  // left-right symmetry
    // Success: within kGoal of the middle throughout the last 4 of 8 s.
    spec_.evaluation = {.seconds = 8, .return_seconds = 8, .hold_seconds = 4};
    obs_.resize(2 * carts_.size());
    for (int i = 0; i < num_envs; ++i) Reset(i);
  }

  const EnvSpec& spec() const override { return spec_; }
  Matrix<const float> obs() const override { return {obs_.data(), num_envs(), 2}; }

  void Step(Matrix<const double> action, StepResult& r) override {
    for (int i = 0; i < num_envs(); ++i) {
      Cart& cart = carts_[size_t(i)];
      const double force = std::clamp(action(i, 0), -1.0, 1.0);
      const double before = cart.x;
      cart.v += kStep * force;
      cart.x += kStep * cart.v;
      ++cart.steps;

      const bool crashed = std::abs(cart.x) > kRail;
      const double terms[] = {1 - std::abs(cart.x), -0.1 * cart.v * cart.v, crashed ? -20.0 : 0.0};
      std::ranges::copy(terms, r.reward_terms.begin() + 3 * i);
      r.reward[size_t(i)] = terms[0] + terms[1] + terms[2];
      r.torque[size_t(i)] = force;
      r.work[size_t(i)] = std::abs(force * (cart.x - before));
      r.at_goal[size_t(i)] = std::abs(cart.x) < kGoal;
      r.terminated[size_t(i)] = crashed;
      r.truncated[size_t(i)] = !crashed && cart.steps == kEpisodeSteps;
      Show(i);
      std::copy_n(obs_.begin() + 2 * i, 2, r.next_obs.begin() + 2 * i);  // before the reset
      if (r.done(size_t(i))) Reset(i);
    }
  }

  void GetState(int env, std::span<double> state) const override {
    state[0] = carts_[size_t(env)].x;
    state[1] = carts_[size_t(env)].v;
  }
  void SetState(int env, std::span<const double> state) override {
    carts_[size_t(env)] = {state[0], state[1], 0};
    Show(env);
  }

  void State(const Archive& archive) override {
    rng_.State(archive.In("rng"));
    for (int i = 0; i < num_envs(); ++i) {
      const Archive a = archive.In(std::to_string(i));
      Cart& cart = carts_[size_t(i)];
      a.Scalar("x", cart.x, {-kRail, kRail});
      a.Scalar("v", cart.v, {-10, 10});
      a.Scalar("steps", cart.steps, {0, kEpisodeSteps - 1});
      Show(i);
    }
  }

 private:
  struct Cart {
    double x = 0, v = 0;
    int64_t steps = 0;
  };

  void Reset(int i) {
    carts_[size_t(i)] = {rng_.Uniform(-1, 1), 0, 0};
    Show(i);
  }
  void Show(int i) {
    obs_[2 * size_t(i)] = float(carts_[size_t(i)].x);
    obs_[2 * size_t(i) + 1] = float(carts_[size_t(i)].v);
  }

  EnvSpec spec_;
  Rng rng_;
  std::vector<Cart> carts_;  // (N)
  std::vector<float> obs_;   // (N, 2)
};

/// Prints a line for each evaluation.
class Printer : public TrainObserver {
  void OnEvaluation(const TrainState& s, const Evaluation& e) override {
    std::printf("%6d steps  success %3.0f%%  return %5.1f\n", int(s.steps), 100 * e.success_rate(),
                e.reward_sum.mean);
  }
};

int main() try {
  DqnConfig dqn;  // defaults, except a small network that chooses from five forces
  dqn.hidden = {32, 32};
  dqn.head = 16;
  dqn.levels = 5;
  dqn.gamma = 0.95;
  dqn.updates_per_step = 0.25;
  TrainConfig train;
  train.envs = 8;
  train.steps = 100000;
  train.eval_every = 2000;

  ThreadPool pool(1);
  CartEnv env(int(train.envs), /*seed=*/1);
  Dqn agent(dqn, env.spec(), /*seed=*/1, pool);
  Printer printer;
  const auto evaluate = [](const Policy& policy, int64_t step) {
    CartEnv carts(50, /*seed=*/1000 + uint64_t(step));
    return Evaluate(policy, carts);
  };
  Trainer trainer({train, evaluate}, agent, env);
  trainer.AddObserver(printer);
  while (trainer.Step()) continue;

  std::printf("%s after %d steps\n", trainer.state().solved ? "solved" : "not solved",
              int(trainer.state().steps));
  return trainer.state().solved ? 0 : 1;
} catch (const Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return error.exit_code();
}
