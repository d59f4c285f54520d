#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>

#include "agents/loaded_policy.h"
#include "base/csv.h"
#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/say.h"
#include "judge/rollout.h"
#include "os/streams.h"
#include "pendulum/control_period.h"
#include "pendulum/start_text.h"
#include "runs/find_policy.h"

namespace upswing {
namespace {

struct SimulateArguments {
  PolicyArguments policy;
  std::string torque, csv = "-";
  TrialArguments trial;
  double seconds = -1;  // negative: not given
};

/// Whether a column has times: `t`, `time`, `timestamp` or `seconds`, also with a unit, such as
/// `Time [s]`, `t_ms` and `time(s)`.
bool IsTime(std::string_view name) {
  const std::string_view word = Trim(name.substr(0, name.find_first_of("[(_")));
  constexpr std::array kNames{"t",         "time",      "Time",    "TIME",
                              "timestamp", "Timestamp", "seconds", "sec"};
  return std::ranges::find(kNames, word) != kNames.end();
}

/// The column `torque` of a CSV file with a row per control step (s). Throws BadInput with the line
/// number, and if a column of times has other steps.
std::vector<double> ReadTorqueFile(const std::string& path, double step) {
  const std::string where = InputName(path), text = ReadInput(path);
  std::vector<std::string> names{"torque"};
  std::ranges::copy_if(CsvNames(text, where), std::back_inserter(names), IsTime);
  const std::vector<CsvColumn> columns = ReadCsv(text, names, where);
  if (columns.front().values.empty())
    throw BadInput(Concat(where, ": expected at least one row of torques, got none"));
  constexpr size_t kMostRows = 1'000'000;  // over five hours; a step takes more memory than a row
  if (columns.front().values.size() > kMostRows) {
    throw BadInput(Concat(where, ": expected at most ", kMostRows, " rows of torques, got ",
                          columns.front().values.size()));
  }
  constexpr double kLargestTime = 1e10;  // s; the steps of larger ones are lost in rounding
  for (const CsvColumn& time : std::span(columns).subspan(1)) {
    for (size_t k = 0; k < time.values.size(); ++k) {
      const double expected = time.values.front() + static_cast<double>(k) * step;
      if (std::abs(expected) < kLargestTime && std::abs(time.values[k] - expected) < 1e-3 * step) {
        continue;
      }
      throw BadInput(Concat(where, ": row ", k + 1, ": ", Printable(time.name), ": expected ",
                            FormatNumber(expected), " s, because each torque acts for ",
                            FormatNumber(step), " s (--control-period), got ",
                            FormatNumber(time.values[k])));
    }
  }
  return columns.front().values;
}

/// For how long each row of the torque file acts.
std::string PeriodText(const SimulateArguments& a, size_t rows, double period) {
  const char* hint = a.trial.control_period > 0 ? "" : "; --control-period sets another";
  return fmt::format("{}: {} of {:.6g} s each, the control period{}", InputName(a.torque),
                     Counted(rows, "torque"), period, hint);
}

int RunSimulate(const SimulateArguments& a) {
  if (!a.policy.empty() && !a.torque.empty()) {
    throw BadInput("simulate: expected a policy or --torque FILE, got both");
  }
  CheckReplaceable("--csv", a.csv, "table of simulate", {"t,q1,q2,"});
  std::optional<LoadedPolicy> loaded;
  if (!a.policy.empty()) loaded.emplace(GetPolicyIn(a.trial, a.policy));
  RolloutConfig config = TrialEpisode(a.trial, loaded ? &*loaded : nullptr);
  const double period = config.env.control_period;
  if (!a.torque.empty()) {
    config.schedule = ReadTorqueFile(a.torque, period);
    // The period of a plant of another size, which nothing else shows.
    if (a.trial.control_period == 0 && period != kControlPeriod) {
      SayError(PeriodText(a, config.schedule.size(), period));
    }
  }

  // The requested number of steps, or one step for each row of the schedule.
  const double scheduled = static_cast<double>(config.schedule.size()) * period;
  const double episode = kEvaluationSeconds * config.env.scale.time;
  const double usual = config.schedule.empty() ? episode : scheduled;
  config.seconds = InWholePeriods("--seconds", a.seconds < 0 ? usual : a.seconds, period);
  if (!config.schedule.empty() &&
      PeriodsIn(config.seconds, period) > static_cast<int64_t>(config.schedule.size())) {
    throw BadInput(Concat("--seconds: expected at most ", FormatNumber(scheduled),
                          " s, the length of ", InputName(a.torque), ", got ",
                          FormatNumber(config.seconds)));
  }
  const Rollout rollout = RunRollout(config);

  WriteOutput(a.csv, RolloutCsv(rollout));
  if (IsStandardStream(a.csv)) return 0;
  fmt::print("{}: {} rows\n", Printable(a.csv), rollout.rows.size());
  if (!a.torque.empty()) {
    fmt::print("  schedule   {}\n", PeriodText(a, config.schedule.size(), period));
  }
  fmt::print("  plant      {}\n", EpisodeText(rollout));
  fmt::print("  start      {}\n", StateText(rollout.rows.front().state));
  fmt::print("  torque     {}\n", TorqueText(rollout));
  fmt::print("  reward     {}\n", RewardText(rollout));
  if (loaded && a.trial.is_of_eval()) {
    fmt::print("  episode    {} of eval: {}\n", a.trial.episode,
               JudgementText(*loaded->policy, config.env));
  }
  return 0;
}

}  // namespace

void AddSimulate(CommandLine& line) {
  SimulateArguments& a = line.Runs(RunSimulate);
  AddPolicy(line, a.policy);
  line.Text(
      "--torque", a.torque, "FILE",
      "CSV file with a column `torque` [N·m], a row per control period; -: standard input. Times "
      "in a column `t` or `time` [s] must be a control period apart");
  AddEpisodeOptions(line, a.trial);
  Options own;
  Option& seconds = own.Add(&a.seconds, "seconds", {0, 1e5}, "s", "length of the rollout");
  seconds.usual = "20, or the length of the file of --torque";
  line.Arguments(own);
  AddTrialOptions(line, a.trial, "noise, random plants and the start of --episode");
  line.Text("--csv", a.csv, "FILE", "CSV file to write; -: standard output (default -)");
  line.Notes(
      "Columns: t [s], q1, q2 [rad], w1, w2 [rad/s], torque [N·m], energy [J],\n"
      "height of the tip [m], inverted (0 or 1), the reward and its five terms, and the torque at\n"
      "each joint, torque1 and torque2 [N·m]. The torque\n"
      "is what the motor applies over the next control period, after its delay and within its\n"
      "limit. The reward is that of this period: of this torque and the next row's state, 0\n"
      "in the last row. The rewards of the first 10 s add up to the return of `eval`; with\n"
      "another control period than the usual one, the return is this sum times their ratio.\n\n"
      "`machine check` and `machine identify` read this file as a log.\n");
  line.Examples(
      "  ./upswing simulate runs/d3qn-seed1 --csv rollout.csv\n"
      "  ./upswing simulate --torque torques.csv --start 0.1,-5deg,0,0 --seconds 10\n"
      "  ./upswing simulate --start 170deg,0,0,0 --damping 0       no motor: it falls\n"
      "  ./upswing eval runs/d3qn-seed1 --randomize 0.25 --episodes-csv episodes.csv\n"
      "  ./upswing simulate runs/d3qn-seed1 --randomize 0.25 --episode 17 --csv e.csv\n");
}

}  // namespace upswing
