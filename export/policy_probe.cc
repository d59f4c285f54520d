// What the library's policy makes of many observations or states: by this the tests judge exports.
//
//     policy_probe POLICY observations <rows >rows    each row D numbers
//     policy_probe POLICY states       <rows >rows    each row S numbers, the start of an episode
//
// All numbers are doubles of this machine. For each row it writes the torque, then what an actor
// puts out, then Q-values or V.
#include <cstdio>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/text.h"
#include "nn/network_policy.h"
#include "run/find_policy.h"
#include "setup/loaded_policy.h"

using namespace upswing;

namespace {

/// All numbers of standard input, in rows of `cols`.
std::vector<double> ReadRows(int cols) {
  std::vector<double> numbers;
  double number = 0;
  while (std::fread(&number, sizeof(number), 1, stdin) == 1) numbers.push_back(number);
  if (numbers.empty() || numbers.size() % static_cast<size_t>(cols) != 0) {
    throw BadInput(Concat("expected rows of ", cols, " doubles, got ", numbers.size(), " doubles"));
  }
  return numbers;
}

/// The observation at the beginning of an episode in each of these states.
std::vector<double> Observe(const LoadedPolicy& loaded) {
  EnvConfig config;
  config.task = loaded.task;
  config.plants = {loaded.plant};
  config.memory = loaded.memory();
  if (loaded.identifies()) config.identified_from = loaded.plant;
  const std::unique_ptr<VectorEnv> env = MakeEnv(config);
  const auto S = static_cast<int>(env->spec().state_names.size());
  const std::vector<double> states = ReadRows(S);
  std::vector<double> observations;
  for (size_t i = 0; i < states.size(); i += static_cast<size_t>(S)) {
    env->SetState(0, std::span(states).subspan(i, static_cast<size_t>(S)));
    const auto obs = env->obs().row(0);
    observations.insert(observations.end(), obs.begin(), obs.end());
  }
  return observations;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string_view what = argc == 3 ? argv[2] : "";
  if (what != "observations" && what != "states") {
    throw BadInput("usage: policy_probe POLICY observations|states");
  }
  const LoadedPolicy loaded = LoadPolicy(argv[1]);
  const Policy& policy = *loaded.policy;
  const int D = policy.obs_size();
  const std::vector<double> rows = what == "states" ? Observe(loaded) : ReadRows(D);
  const std::vector<float> obs(rows.begin(), rows.end());
  const auto count = static_cast<int>(rows.size()) / D;
  const Matrix<const float> all(obs.data(), count, D);
  const auto* learned = dynamic_cast<const NetworkPolicy*>(&policy);
  const bool is_actor = learned != nullptr && learned->is_actor();
  const int outputs = is_actor ? learned->num_outputs() : 0;

  const auto memory = policy.Start(count);
  const auto size = [&](int cols) {
    return static_cast<size_t>(count) * static_cast<size_t>(cols);
  };
  std::vector<double> torques(size(1));
  std::vector<float> out(size(outputs)), values(size(policy.num_values()));
  policy.Act(all, {torques.data(), count, 1}, *memory);
  if (is_actor) learned->Outputs(all, {out.data(), count, outputs}, *memory);
  if (policy.num_values() > 0) {
    policy.Values(all, {values.data(), count, policy.num_values()}, *memory);
  }
  const auto write = [](double number) { std::fwrite(&number, sizeof(number), 1, stdout); };
  for (int i = 0; i < count; ++i) {
    write(torques[static_cast<size_t>(i)]);
    for (int k = 0; k < outputs; ++k) write(out[static_cast<size_t>(i * outputs + k)]);
    for (int k = 0; k < policy.num_values(); ++k) {
      write(values[static_cast<size_t>(i * policy.num_values() + k)]);
    }
  }
  return std::fflush(stdout) == 0 ? 0 : 1;
} catch (const Error& error) {
  std::fprintf(stderr, "policy_probe: %s\n", error.what());
  return error.exit_code();
}
