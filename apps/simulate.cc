#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>

#include "apps/commands.h"
#include "apps/config.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"

namespace upswing {
namespace {

constexpr double kStepsPerSecond = 50;  // 1 / kControlPeriod, exactly
static_assert(kStepsPerSecond * kControlPeriod == 1);

struct SimulateArguments {
  std::string policy, torque, start = "0,0,0,0", csv, model;
  std::vector<std::string> set;
  std::optional<double> seconds;
};

/// The column `torque` of a CSV file. Lines that begin with # and empty lines are skipped. Throws
/// BadInput with the line.
std::vector<double> ReadTorqueFile(const std::string& path) {
  const std::string text = ReadTextFile(path);
  std::vector<double> torques;
  std::optional<size_t> column;
  size_t columns = 0;
  int line_number = 0;
  for (const std::string_view line : Split(text, '\n')) {
    ++line_number;
    if (line.empty() || line.starts_with('#')) continue;
    const std::vector<std::string_view> cells = Split(line, ',');
    const std::string place = Concat(path, ":", line_number, ": ");
    if (!column) {
      const auto found = std::find(cells.begin(), cells.end(), "torque");
      if (found == cells.end()) {
        throw BadInput(Concat(place, "expected a column \"torque\", got \"", line, "\""));
      }
      column = static_cast<size_t>(found - cells.begin());
      columns = cells.size();
      continue;
    }
    if (cells.size() != columns) {
      throw BadInput(Concat(place, "expected ", columns, " columns, got ", cells.size()));
    }
    const auto torque = ParseNumber(cells[*column]);
    if (!torque || !std::isfinite(*torque)) {
      throw BadInput(
          Concat(place, "torque: expected a finite number, got \"", cells[*column], "\""));
    }
    torques.push_back(*torque);
  }
  if (torques.empty()) throw BadInput(Concat(path, ": expected rows of torques, got none"));
  return torques;
}

PendulumState ParseStart(const std::string& text) {
  const std::vector<std::string_view> pieces = Split(text, ',');
  std::vector<double> numbers;
  for (const std::string_view piece : pieces) {
    const auto number = ParseNumber(piece);
    if (number && std::isfinite(*number)) numbers.push_back(*number);
  }
  if (pieces.size() != 4 || numbers.size() != 4) {
    throw BadInput(Concat("--start: expected four numbers q1,q2,w1,w2, got \"", text, "\""));
  }
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

std::string CsvRow(double t, const PendulumState& s, double torque, const Plant& plant) {
  const auto terms = RewardTerms(plant, s, torque);
  double reward = 0;
  for (const double term : terms) reward += term;
  std::string row = FormatNumber(t);
  for (const double x : {s.q1, s.q2, s.w1, s.w2, torque, Energy(plant, s), TipHeight(plant, s),
                         Inverted(s) ? 1.0 : 0.0, reward}) {
    row += ',' + FormatNumber(x);
  }
  for (const double term : terms) row += ',' + FormatNumber(term + 0.0);  // no -0
  return row + '\n';
}

int RunSimulate(const SimulateArguments& a) {
  if (!a.policy.empty() && !a.torque.empty()) {
    throw BadInput("simulate: expected a policy or --torque, got both");
  }
  std::optional<LoadedPolicy> loaded;
  if (!a.policy.empty()) loaded.emplace(LoadPolicy(a.policy));
  std::vector<double> schedule;
  if (!a.torque.empty()) schedule = ReadTorqueFile(a.torque);

  // As many steps as were asked for, or as the schedule has rows.
  const double scheduled = static_cast<double>(schedule.size()) / kStepsPerSecond;
  const double seconds = a.seconds.value_or(schedule.empty() ? 20.0 : scheduled);
  if (!std::isfinite(seconds)) throw BadInput("--seconds: expected a finite number");
  const int64_t steps = std::llround(seconds * kStepsPerSecond);
  if (!schedule.empty() && steps > static_cast<int64_t>(schedule.size())) {
    throw BadInput(Concat("--seconds: expected at most ", FormatNumber(scheduled), ", for which ",
                          a.torque, " has torques, got ", FormatNumber(seconds)));
  }

  PendulumEnvConfig config;
  if (loaded) config.mjcf = loaded->mjcf;
  if (loaded) config.memory = loaded->memory;
  const Plant plant = ChangedPlant(loaded ? loaded->plant : Plant(), a.model, a.set, config.mjcf);
  config.plants = {plant};
  config.episode_seconds = seconds + 1;
  PendulumEnv env(config);
  env.SetState(0, ParseStart(a.start));

  std::string csv =
      "t,qpos0,qpos1,qvel0,qvel1,torque,energy,height,inverted,reward,energy_reward,height_reward,"
      "balance_reward,velocity_penalty,torque_penalty\n";
  StepResult result = env.MakeResult();
  for (int64_t k = 0; k <= steps; ++k) {
    // Behind the end of a schedule there is one more state, which no torque follows.
    double torque = 0;
    if (loaded) loaded->policy.Act(env.obs(), std::span(&torque, 1));
    if (static_cast<size_t>(k) < schedule.size()) torque = schedule[static_cast<size_t>(k)];
    torque = std::clamp(torque, -plant.torque_limit, plant.torque_limit);
    const double t = static_cast<double>(k) / kStepsPerSecond;
    csv += CsvRow(t, env.state(0), torque, plant);
    if (k == steps) break;
    env.Step(std::span(&torque, 1), result);
    if (result.terminated[0]) {
      throw Failure(Concat("simulate: the state blew up numerically after t = ", FormatNumber(t),
                           " s (MuJoCo gave it up)"));
    }
  }
  if (a.csv.empty()) {
    fmt::print("{}", csv);
  } else {
    WriteFileAtomically(a.csv, csv);
    fmt::print("{}: {} rows\n", a.csv, steps + 1);
  }
  return 0;
}

}  // namespace

void AddSimulate(CLI::App& program, Command& command) {
  CLI::App* app = program.add_subcommand(
      "simulate", "Write one rollout of a policy, of given torques, or of none as CSV");
  auto a = std::make_shared<SimulateArguments>();
  app->add_option("policy", a->policy, "policy.safetensors or run folder")
      ->type_name("POLICY|RUN")
      ->check(NotEmpty());
  app->add_option("--torque", a->torque,
                  "CSV file with a column `torque` (N·m), a row for each 0.02 s")
      ->type_name("FILE")
      ->check(NotEmpty());
  app->add_option("--start", a->start, "where it begins, rad and rad/s [0,0,0,0: hanging]")
      ->type_name("q1,q2,w1,w2");
  app->add_option("--seconds", a->seconds, "how long [20, or as long as the torques last]")
      ->check(CLI::Range(0.0, 1e5).description(""))
      ->type_name("SECONDS");
  AddPlantOptions(*app, a->set, a->model);
  app->add_option("--csv", a->csv, "file to write [standard output]")
      ->type_name("FILE")
      ->check(NotEmpty());
  app->footer(
      "Columns: t (s), qpos0, qpos1 (rad), qvel0, qvel1 (rad/s), torque (N·m, held over the next\n"
      "0.02 s, within the motor's limit), energy (J), height of the tip (m), inverted (0 or 1), "
      "and\n"
      "the reward with its five terms for the state and the torque of that row.\n\n"
      "Examples:\n"
      "  ./upswing simulate runs/d3qn-seed1 --csv rollout.csv\n"
      "  ./upswing simulate --torque torques.csv --start 0.1,-0.05,0,0 --seconds 10\n"
      "  ./upswing simulate --start 3.0,0,0,0 --set damping=0      let it fall\n");
  app->callback([a, &command] { command = [a] { return RunSimulate(*a); }; });
}

}  // namespace upswing
