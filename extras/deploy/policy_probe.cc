// Evaluates the library's policy on many observations or states, so that tests can check exports.
//
//     policy_probe POLICY observations <rows >rows    each row D numbers
//     policy_probe POLICY states       <rows >rows    each row q1 q2 w1 w2, the start of an episode
//     policy_probe POLICY motion       <rows >rows    each row a control step of an episode:
//         1 if an episode begins, else 0; q1 q2 w1 w2; the torque that acted after them; the goal,
//         1 or 0 for each link that points up or down
//
// All numbers are doubles in this machine's byte order. Each output row is the torque, then an
// actor's outputs, then Q-values or V; of a motion, the torque, then the observation.
#include <cstdio>
#include <optional>
#include <string_view>
#include <vector>

#include "agents/loaded_policy.h"
#include "base/error.h"
#include "nn/network_policy.h"
#include "runs/find_policy.h"

using namespace upswing;

namespace {

void Write(double number) { std::fwrite(&number, sizeof(number), 1, stdout); }

/// Reads a row. Returns false at the end.
bool Read(std::vector<double>& row) {
  return std::fread(row.data(), sizeof(double), row.size(), stdin) == row.size();
}

/// Torques for observations, or for states in which an episode begins.
void ProbeMoments(const LoadedPolicy& loaded, bool states) {
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
  std::vector<double> row(states ? 4 : static_cast<size_t>(policy.obs_size()));
  std::vector<float> outputs(is_actor ? static_cast<size_t>(learned->num_outputs()) : 0);
  std::vector<float> values(static_cast<size_t>(policy.num_values()));
  while (Read(row)) {
    std::vector<float> numbers(row.begin(), row.end());
    Matrix<const float> obs(numbers.data(), 1, policy.obs_size());
    if (states) {
      env.SetState(0, {row[0], row[1], row[2], row[3]});
      obs = env.obs();
    }
    const auto memory = policy.Start(1);
    double torque = 0;
    policy.Act(obs, {&torque, 1, 1}, *memory);
    Write(torque);
    if (is_actor) learned->Outputs(obs, {outputs.data(), 1, learned->num_outputs()}, *memory);
    for (const float output : outputs) Write(output);
    if (!values.empty()) policy.Values(obs, {values.data(), 1, policy.num_values()}, *memory);
    for (const float value : values) Write(value);
  }
}

/// Torques and observations along motions that the caller gives.
void ProbeMotion(const LoadedPolicy& loaded) {
  const Policy& policy = *loaded.policy;
  ObservationBuilder builder(1, loaded.scale(), loaded.control_period(), loaded.memory(),
                             loaded.identifies() ? std::optional(loaded.plant) : std::nullopt);
  std::vector<float> obs(static_cast<size_t>(policy.obs_size())), before = obs;
  std::unique_ptr<Policy::Memory> memory;
  std::vector<double> row(8);
  double torque = 0, acted = 0;
  while (Read(row)) {
    const PendulumState state{row[1], row[2], row[3], row[4]};
    obs.swap(before);
    if (row[0] != 0) {
      builder.Begin(0, loaded.plant, state, obs);
      memory = policy.Start(1);
    } else {
      builder.Next(0, loaded.plant, {state, acted}, before, acted, obs);
    }
    if (loaded.seeks_any_pose()) WriteGoal({row[6] != 0, row[7] != 0}, loaded.memory(), obs);
    policy.Act({obs.data(), 1, policy.obs_size()}, {&torque, 1, 1}, *memory);
    acted = row[5];
    Write(torque);
    for (const float number : obs) Write(number);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string_view what = argc == 3 ? argv[2] : "";
  if (what != "observations" && what != "states" && what != "motion") {
    throw BadInput("usage: policy_probe POLICY observations|states|motion");
  }
  const LoadedPolicy loaded = LoadPolicy(argv[1]);
  if (what == "motion") {
    ProbeMotion(loaded);
  } else {
    ProbeMoments(loaded, what == "states");
  }
  return std::fflush(stdout) == 0 ? 0 : 1;
} catch (const Error& error) {
  std::fprintf(stderr, "policy_probe: %s\n", error.what());
  return error.exit_code();
}
