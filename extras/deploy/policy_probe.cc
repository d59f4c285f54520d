// Evaluates the library's policy on many observations or states, so that tests can check exports.
//
//     policy_probe POLICY observations <rows >rows    each row D numbers
//     policy_probe POLICY states       <rows >rows    each row q1 q2 w1 w2, the start of an episode
//
// All numbers are doubles in this machine's byte order. Each output row is the torque, then an
// actor's outputs, then Q-values or V.
#include <cstdio>
#include <string_view>
#include <vector>

#include "agents/loaded_policy.h"
#include "base/error.h"
#include "nn/network_policy.h"
#include "runs/find_policy.h"

using namespace upswing;

int main(int argc, char** argv) try {
  const std::string_view what = argc == 3 ? argv[2] : "";
  if (what != "observations" && what != "states") {
    throw BadInput("usage: policy_probe POLICY observations|states");
  }
  const LoadedPolicy loaded = LoadPolicy(argv[1]);
  const Policy& policy = *loaded.policy;
  PendulumEnvConfig config;
  config.plants = {loaded.plant};
  config.memory = loaded.memory();
  if (loaded.identifies()) config.identified_from = loaded.plant;
  config.any_pose = loaded.seeks_any_pose();
  config.goal = Pose();
  PendulumEnv env(config);
  const auto* learned = dynamic_cast<const NetworkPolicy*>(&policy);
  const bool is_actor = learned != nullptr && learned->is_actor();

  const auto write = [](double number) { std::fwrite(&number, sizeof(number), 1, stdout); };
  std::vector<double> row(what == "states" ? 4 : static_cast<size_t>(policy.obs_size()));
  std::vector<float> outputs(is_actor ? static_cast<size_t>(learned->num_outputs()) : 0);
  std::vector<float> values(static_cast<size_t>(policy.num_values()));
  while (std::fread(row.data(), sizeof(double), row.size(), stdin) == row.size()) {
    std::vector<float> numbers(row.begin(), row.end());
    Matrix<const float> obs(numbers.data(), 1, policy.obs_size());
    if (what == "states") {
      env.SetState(0, {row[0], row[1], row[2], row[3]});
      obs = env.obs();
    }
    const auto memory = policy.Start(1);
    double torque = 0;
    policy.Act(obs, {&torque, 1, 1}, *memory);
    write(torque);
    if (is_actor) learned->Outputs(obs, {outputs.data(), 1, learned->num_outputs()}, *memory);
    for (const float output : outputs) write(output);
    if (!values.empty()) policy.Values(obs, {values.data(), 1, policy.num_values()}, *memory);
    for (const float value : values) write(value);
  }
  return std::fflush(stdout) == 0 ? 0 : 1;
} catch (const Error& error) {
  std::fprintf(stderr, "policy_probe: %s\n", error.what());
  return error.exit_code();
}
