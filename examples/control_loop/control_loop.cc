// Runs a policy file in your own control loop. Reads a line `q1 q2 w1 w2` (rad, rad/s) from
// standard input every 0.02 s, and answers with the torque (N·m) to hold until the next line.
//
//     control_loop policy.safetensors <measurements >torques
#include <cstdio>
#include <iostream>
#include <memory>

#include "agents/loaded_policy.h"
#include "base/error.h"
#include "base/text.h"
#include "pendulum/plant.h"
#include "runs/find_policy.h"

using namespace upswing;

int main(int argc, char** argv) try {
  if (argc != 2) throw BadInput("usage: control_loop policy.safetensors");
  const LoadedPolicy loaded = LoadPolicy(argv[1]);
  const Policy& policy = *loaded.policy;
  ExpectPendulum(loaded);
  if (loaded.memory() > 0) throw BadInput("expected a policy without memory, got one with it");

  const std::unique_ptr<Policy::Memory> memory = policy.Start(/*num_envs=*/1);
  PendulumState s;
  while (std::cin >> s.q1 >> s.q2 >> s.w1 >> s.w2) {
    const auto obs = Observe(loaded.plant, s);
    double torque = 0;
    policy.Act({obs.data(), 1, policy.obs_size()}, {&torque, 1, 1}, *memory);
    std::cout << FormatNumber(torque) << std::endl;  // flush: the motor waits for it
  }
  if (!std::cin.eof()) throw BadInput("expected four numbers in a line: q1 q2 w1 w2");
} catch (const Error& error) {
  std::fprintf(stderr, "control_loop: %s\n", error.what());
  return error.exit_code();
}
