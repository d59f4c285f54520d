// Trains the agent `fast` on the double pendulum, in memory, and evaluates it on 100 new starts.
#include <cstdio>

#include "agents/config.h"
#include "agents/training.h"
#include "base/error.h"
#include "mujoco/engines.h"
#include "pendulum/pendulum_env.h"
#include "runs/config_files.h"
#include "runs/this_host.h"

using namespace upswing;

/// Prints a line for each evaluation of the training.
class Printer : public TrainObserver {
  void OnEvaluation(const TrainState& s, const Evaluation& e) override {
    std::printf("%7d steps  success %3.0f%%  return %4.0f\n", static_cast<int>(s.steps),
                100 * e.success_rate(), e.reward_sum.mean);
  }
};

int main() try {
  // Settings have the names of the flags in `upswing train --help`.
  Printer printer;
  Training training(BuildConfig("", {{"agent", "fast"}, {"seed", "1"}}), ThisHost(/*threads=*/2));
  training.AddObserver(printer);
  while (training.Step()) continue;
  std::printf("%s\n", training.state().solved ? "solved" : "not solved");

  PendulumEnvConfig test;  // hanging with little noise
  test.engine = &kMuJoCo;
  test.num_envs = 100;
  test.seed = 2;
  PendulumEnv pendulums(test);
  const Evaluation e = Evaluate(*training.policy(), pendulums);
  std::printf("judged in MuJoCo: %d of %d episodes succeed; swing-up in %.2f s (median)\n",
              static_cast<int>(e.successes), static_cast<int>(e.episodes),
              e.swing_up_seconds.median);
} catch (const Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return error.exit_code();
}
