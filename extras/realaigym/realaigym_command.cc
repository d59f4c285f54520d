#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/format.h"
#include "base/json.h"
#include "base/sample.h"
#include "base/stopwatch.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "extras/machine/logs/check.h"
#include "extras/realaigym/boards.h"
#include "extras/realaigym/hardware.h"
#include "extras/realaigym/machine_trials.h"
#include "extras/realaigym/olympics.h"
#include "os/host.h"
#include "os/streams.h"

namespace upswing::realaigym {
namespace {

struct ScoreArguments {
  PolicyArguments policy;
  std::string robot, twin, machine, csv, score_version = "3";
  int64_t runs = 100, threads = 0, seed = 1;
  bool as_json = false, no_pushes = false;

  bool version2() const { return score_version == "2"; }
  bool olympics() const { return score_version == "2026"; }
};

struct HardwareArguments {
  std::vector<std::string> logs;
  std::string robot, score_version = "2";
  bool as_json = false;
};

void PrintReport(const BoardReport& report, double seconds) {
  const BoardOutcome& o = report.nominal;
  const auto& rows = report.robustness.rows;
  fmt::print("{} on RealAIGym's {}, simulation, score version 2\n", Printable(report.policy->name),
             NameOf(RobotOf(*report.policy)));
  fmt::print("  performance  S {:.3f}: ", PerformanceScore(o));
  if (o.above_line) {
    fmt::print("swing-up {:.2f} s, energy {:.2f} J, cost {:.2f} N²m²s, smoothness {:.4f} N·m, ",
               o.swing_up_seconds, o.energy, o.torque_cost, o.smoothness);
    fmt::print("speed {:.1f} rad²/s\n", o.velocity_cost);
  } else {
    fmt::print("no swing-up, the tip is not above 0.45 m at the end\n");
  }
  fmt::print("  robustness   R {:.3f}:", report.robustness.score());
  for (size_t row = 0; row < rows.size(); ++row) {
    fmt::print("{} {} {:.1f}%", row == 0 ? "" : ",", kRobustnessRowNames.at(row), 100 * rows[row]);
  }
  fmt::print("\n  {} simulations of 10 s in {:.2f} s; largest torque {:.2f} N·m\n",
             kBoardSimulations, seconds, o.max_torque);
}

/// `place`: where the runs were, such as "simulation".
void PrintUptimes(const UptimeReport& report, const std::string& place) {
  const auto [least, most] = std::ranges::minmax(report.runs, {}, &UptimeRun::score);
  double swing_ups = 0;
  for (const UptimeRun& run : report.runs) swing_ups += run.swing_ups;
  const Interval interval = report.interval();
  fmt::print("{} on RealAIGym's {}, {}, score version 3\n", Printable(report.policy->name),
             NameOf(RobotOf(*report.policy)), place);
  fmt::print("  {:<22} {:>6} {:>15} {:>15} {:>10}\n", "", "score", "95%", "least to most",
             "swing-ups");
  fmt::print("  {:<22} {:>6.3f} {:>15} {:>15} {:>10.1f}\n", Counted(report.runs.size(), "run"),
             report.scores().mean, fmt::format("{:.3f}–{:.3f}", interval.low, interval.high),
             fmt::format("{:.3f}–{:.3f}", least.score, most.score),
             swing_ups / static_cast<double>(report.runs.size()));
}

void PrintHardware(const HardwareReport& report) {
  const auto print = [](const std::string& name, const std::array<std::string, 7>& cells) {
    fmt::print("  {:<36} {:>7} {:>6} {:>7} {:>7} {:>7} {:>7} {:>6}\n", Shortened(name, 36),
               cells[0], cells[1], cells[2], cells[3], cells[4], cells[5], cells[6]);
  };
  const auto number = [](double x, int decimals) { return fmt::format("{:.{}f}", x, decimals); };
  const char* pushed = report.pushed ? " with pushes" : "";
  fmt::print("Runs of RealAIGym's {}{}, hardware, version 2\n", NameOf(report.robot), pushed);
  print("", {"success", "time", "energy", "cost", "smooth", "speed", "score"});
  print("", {"", "s", "J", "N²m²s", "N·m", "rad²/s", "S"});
  for (const HardwareRun& run : report.runs) {
    const BoardOutcome& o = run.outcome;
    std::string success = "no";
    std::string seconds = "–";
    if (o.above_line) {
      success = "yes";
      seconds = number(o.swing_up_seconds, 2);
    }
    print(Printable(run.name),
          {success, seconds, number(o.energy, 2), number(o.torque_cost, 2), number(o.smoothness, 3),
           number(o.velocity_cost, 1), number(run.score, 3)});
  }
  print("mean", {fmt::format("{}/{}", report.successes(), report.runs.size()), "–", "–", "–", "–",
                 "–", number(report.mean(), 3)});
  for (const HardwareRun& run : report.runs) {
    if (run.outcome.above_line) continue;
    fmt::print("  {}: {} after {:.2f} s\n", Printable(run.name),
               run.seconds < kHardwareSeconds ? "the run ends" : "the tip is not above 0.45 m",
               run.seconds);
  }
}

/// Prints the scores of logs by version 3.
int ScoreUptimeLogs(const HardwareArguments& a, std::span<const MachineLog> logs) {
  nlohmann::ordered_json json;
  for (const MachineLog& log : logs) {
    const UptimeRun run = UptimeOf(log);
    if (a.as_json) {
      json["runs"].push_back(
          {{"name", log.name}, {"score", run.score}, {"swing_ups", run.swing_ups}});
    } else {
      fmt::print("{}: score {:.3f}, {:.2f} s upright, {}\n", Printable(log.name), run.score,
                 run.score * kUptimeSeconds, Counted(run.swing_ups, "swing-up"));
    }
  }
  if (a.as_json) fmt::print("{}\n", PrintableJson(json));
  return 0;
}

int RunHardware(const HardwareArguments& a) {
  const std::optional<Robot> robot = ParseRobot(a.robot);
  const std::vector<MachineLog> logs = ReadCheckedLogs(a.logs, "", SayError);
  if (a.score_version == "3") return ScoreUptimeLogs(a, logs);
  const HardwareReport report = ScoreHardware(logs, robot);
  if (a.as_json) {
    fmt::print("{}\n", HardwareJson(report));
  } else {
    PrintHardware(report);
  }
  return 0;
}

/// Scores a policy by version 2 on machines drawn from a twin's posterior.
void ScoreOnTwin(const ScoreArguments& a, const Twin& twin, const MachinePolicy& policy,
                 ThreadPool& pool) {
  const TrialRules rules{.count = static_cast<int>(a.runs),
                         .pushes = !a.no_pushes,
                         .seed = static_cast<uint64_t>(a.seed)};
  HardwareReport report;
  {
    EpisodeProgress progress(a.as_json, "machines");
    report =
        RunTrials(twin, RobotOf(*policy), OnMachine(ControllersOf(policy), twin, RobotOf(*policy)),
                  rules, &pool, std::ref(progress));
  }
  const Interval interval = WilsonInterval(report.successes(), a.runs);
  if (a.as_json) {
    fmt::print("{}\n", PrintableJson({{"policy", policy->name},
                                      {"twin", twin.name},
                                      {"pushed", report.pushed},
                                      {"runs", a.runs},
                                      {"successes", report.successes()},
                                      {"interval", {interval.low, interval.high}},
                                      {"mean_score", report.mean()}}));
    return;
  }
  fmt::print(
      "{} on {} of {}{}: {} of {} swing up and stay, {:.1f}% (95%: {:.1f}–{:.1f}%), mean "
      "score {:.3f}\n",
      Printable(policy->name), Counted(a.runs, "machine"), Printable(twin.name),
      report.pushed ? ", pushed" : "", report.successes(), a.runs,
      100.0 * report.successes() / static_cast<double>(a.runs), 100 * interval.low,
      100 * interval.high, report.mean());
}

/// Scores a policy by version 3, in simulation or on machines drawn from a twin's posterior.
void ScoreUptimes(const ScoreArguments& a, const std::optional<Twin>& twin,
                  const MachinePolicy& policy, ThreadPool& pool) {
  const auto seed = static_cast<uint64_t>(a.seed);
  UptimeReport report{policy, {}};
  {
    EpisodeProgress progress(a.as_json, "runs");
    if (twin) {
      report.runs = RunUptimeTrials(
          *twin, OnMachine(ControllersOf(policy), *twin, RobotOf(*policy), kHardwareResets),
          {.count = static_cast<int>(a.runs), .seed = seed}, &pool, std::ref(progress));
    } else {
      report.runs = ScoreUptime(policy, seed, static_cast<int>(a.runs), pool, std::ref(progress));
    }
  }
  if (a.as_json) {
    fmt::print("{}\n", UptimeJson(report));
  } else {
    PrintUptimes(report, twin ? Concat("machines of ", Printable(twin->name)) : "simulation");
  }
}

/// A count as a share of `all`, with its 95% interval.
std::string ShareText(int64_t count, int64_t all) {
  const Interval interval = WilsonInterval(count, all);
  return fmt::format("{:>5} of {:<5} {:>5.1f}%  ({:.1f}–{:.1f}%)", count, all,
                     100.0 * static_cast<double>(count) / static_cast<double>(all),
                     100 * interval.low, 100 * interval.high);
}

/// Scores a policy by the task of 2026 on machines drawn from the posterior of `machines`.
void ScoreOlympics(const ScoreArguments& a, const Twin& twin, const MachinePolicy& policy,
                   const Twin& machines, ThreadPool& pool) {
  std::vector<OlympicsRun> runs;
  {
    EpisodeProgress progress(a.as_json, "machines");
    runs = RunOlympics(twin, policy, machines, static_cast<int>(a.runs),
                       static_cast<uint64_t>(a.seed), &pool, std::ref(progress));
  }
  int64_t held = 0, poses = 0, pushes = 0, perfect = 0, beyond = 0;
  for (const OlympicsRun& run : runs) {
    held += run.held;
    poses += run.poses;
    pushes += run.pushes;
    perfect += run.perfect();
    beyond += !run.within_limits;
  }
  if (a.as_json) {
    fmt::print("{}\n", PrintableJson({{"policy", policy->name},
                                      {"twin", twin.name},
                                      {"machine", machines.name},
                                      {"runs", a.runs},
                                      {"held", held},
                                      {"poses", poses},
                                      {"pushes", pushes},
                                      {"perfect", perfect},
                                      {"beyond_limits", beyond}}));
    return;
  }
  fmt::print("{} on {} of {}, the {}'s task of 2026\n", Printable(policy->name),
             Counted(a.runs, "machine"), Printable(machines.name), NameOf(RobotOf(*policy)));
  fmt::print("  swings up and stays     {}\n", ShareText(held, a.runs));
  fmt::print("  back after a pose       {}\n", ShareText(poses, a.runs * kOlympicsPoses));
  fmt::print("  back after a push       {}\n", ShareText(pushes, a.runs * kOlympicsPushes));
  fmt::print("  all of this             {}\n", ShareText(perfect, a.runs));
  if (beyond > 0) fmt::print("  beyond the limits       {}\n", ShareText(beyond, a.runs));
}

/// Throws BadInput unless a twin has about the size of RealAIGym's robots. Limits, resets and
/// normalisers of versions 2 and 3 are for these.
void ExpectUsualSize(const ScoreArguments& a, const Twin& twin) {
  const Scale scale = ScaleOverUsual(twin.plant);
  if (scale == Scale()) return;
  throw BadInput(
      fmt::format("--twin: expected a machine of about the size of RealAIGym's robots, for which "
                  "--score-version {} is, got one with times × {:.3g} and torques × {:.3g}",
                  a.score_version, scale.time, scale.torque));
}

int RunScore(const ScoreArguments& a) {
  if (a.policy.empty()) throw BadInput("realaigym score: expected a policy, got none");
  if (!a.csv.empty()) {
    CheckReplaceable("--csv", a.csv, "table of score", {std::string(kBoardHeader)});
  }
  if (IsStandardStream(a.csv) && a.as_json) {
    throw BadInput(
        "--json: expected a file for --csv, got - (standard output), where the JSON goes");
  }
  ThreadPool pool(ResolveThreads(a.threads));
  std::optional<Twin> twin;
  if (!a.twin.empty()) twin = ReadTwin(a.twin, "--twin");
  if (twin && !a.olympics()) ExpectUsualSize(a, *twin);
  const MachinePolicy policy =
      GetMachinePolicy(a.policy, a.robot, twin, a.olympics() ? kOlympicsHz : kBoardHz);
  const auto seed = static_cast<uint64_t>(a.seed);
  if (!a.csv.empty()) {
    WriteOutput(a.csv, BoardCsv(a.version2() ? NominalLog(policy) : UptimeLog(policy, seed)));
    if (IsStandardStream(a.csv)) return 0;
  }
  std::optional<Twin> machines = twin;  // which the policy's runs are on
  if (!a.machine.empty()) machines = ReadTwin(a.machine, "--machine");
  if (a.olympics()) {
    ScoreOlympics(a, *twin, policy, *machines, pool);
  } else if (!a.version2()) {
    ScoreUptimes(a, twin, policy, pool);
  } else if (twin) {
    ScoreOnTwin(a, *twin, policy, pool);
  } else {
    const Stopwatch watch;
    BoardReport report;
    {
      EpisodeProgress progress(a.as_json);
      report = ScoreOnBoard(policy, seed, pool, std::ref(progress));
    }
    if (a.as_json) {
      fmt::print("{}\n", BoardJson(report));
    } else {
      PrintReport(report, watch.seconds());
    }
  }
  if (a.as_json) return 0;
  const std::string other = twin ? std::string() : OtherPlant(policy);
  if (!other.empty()) fmt::print("  designed for {}, not for the board's plant\n", other);
  if (machines && machines->covariance.empty()) {
    fmt::print("  all machines are equal, because {} has no [covariance]\n",
               Printable(machines->name));
  }
  if (!a.csv.empty()) fmt::print("  written {}\n", Printable(a.csv));
  return 0;
}

/// Adds --robot, --json and --score-version with the choices of `versions`.
void AddCommon(CommandLine& line, std::string& robot, bool& as_json, Options& rules,
               std::string& version, const std::vector<std::string>& versions) {
  line.Text("--robot", robot, "ROBOT",
            "pendubot or acrobot (default: the policy's, or the joint with more torque in a log)");
  line.Flag("--json", as_json, "print JSON instead of a table");
  rules.Section("rules");
  std::string help = "rules; 2: one swing-up of 10 s, 3: time upright in 60 s with random resets";
  if (versions.size() > 2) help += ", 2026: swing-up, 24 poses and 10 pushes on CloudPendulum";
  rules.AddChoice(&version, "score_version", versions, help);
}

void AddScore(CommandLine& line) {
  ScoreArguments& a = line.Runs(RunScore);
  AddPolicy(line, a.policy);
  Options rules;
  AddCommon(line, a.robot, a.as_json, rules, a.score_version, {"2", "3", "2026"});
  rules.Add(&a.runs, "runs", {1, 1e6}, "",
            "number of runs with resets, or of machines of the twin");
  line.Arguments(rules);
  line.Text("--twin", a.twin, "FILE",
            "score on machines drawn from this twin, by the hardware rules");
  line.Text(
      "--machine", a.machine, "FILE",
      "version 2026: machine to score on, or the twin from which machines are drawn; --twin is the "
      "user's knowledge of it (default: --twin)");
  AddSeed(line, a.seed, "resets, noise, pushes and machines");
  AddThreads(line, a.threads);
  line.Flag("--no-pushes", a.no_pushes, "no pushes on the twin's machines, version 2");
  line.Text("--csv", a.csv, "FILE",
            "CSV file to write, the first motion in the format of RealAIGym; -: standard output, "
            "without a table");
  line.Excludes("--twin", {"--csv"});
  line.Check([&line, &a] {
    if (line.Has("--no-pushes") && (a.twin.empty() || !a.version2())) {
      throw BadInput("--no-pushes: expected --twin FILE and --score-version 2 with it");
    }
    if (a.olympics() && a.twin.empty()) {
      throw BadInput("--score-version 2026: expected --twin FILE with it, such as cloudpendulum");
    }
    if (line.Has("--machine") && !a.olympics()) {
      throw BadInput("--machine: expected --score-version 2026 with it");
    }
  });
  line.Notes(
      "Version 3: runs of 60 s on RealAIGym's plant C.1 without friction, at 500 Hz, from\n"
      "hanging. At 15 random times both motors drive the links to random angles for 0.2 s. The\n"
      "score is the share of the time with the tip above 90% of the length. With --twin, runs\n"
      "have 10 softer resets of 1 s, as on the real robot.\n\n"
      "Version 2: performance in one swing-up of 10 s; robustness in 722 simulations with model\n"
      "errors, noise, a motor that responds too little or too much, delay and pushes. With\n"
      "--twin, one swing-up on each machine, with pushes.\n\n"
      "Version 2026: CloudPendulum's task at 400 Hz with late cycles, on machines of --twin. The\n"
      "motor swings up and holds for 3 s, then a hand leads the links to 24 poses, and 10 torques\n"
      "of 0.02 to 0.1 N·m push joint 1. The passive joint gets no torque.\n\n"
      "--twin designs a controller for the twin without dry friction; --made-for changes this\n"
      "plant. The motors compensate " +
      fmt::format("{:.0f}%", 100 * kCompensated) +
      " of the estimated dry friction.\n\n"
      "docs/results/realaigym.md has the published entries.\n");
  line.Examples(
      "  ./upswing train --agent pendubot && ./upswing realaigym score runs/pendubot-seed1\n"
      "  ./upswing realaigym score tvlqr --made-for realaigym --score-version 2\n"
      "  ./upswing realaigym score runs/pendubot-seed1 --csv sim_swingup.csv\n"
      "  ./upswing realaigym score tvlqr --lqr-q1 100 --lqr-q2 100 --twin realaigym-twin\n"
      "  ./upswing realaigym score mpc --twin cloudpendulum --score-version 2026 --runs 20\n");
}

void AddHardware(CommandLine& line) {
  HardwareArguments& a = line.Runs(RunHardware);
  line.Texts("log", a.logs, "LOG", "logs of runs on the real robot, .csv or .csv.gz");
  line.Require("log");
  Options rules;
  AddCommon(line, a.robot, a.as_json, rules, a.score_version, {"2", "3"});
  line.Arguments(rules);
  line.Notes(
      "Version 2: all logs must be of one robot. A log with tau_pert belongs to the board with\n"
      "pushes. Version 3 also scores simulated runs in the format of RealAIGym.\n");
  line.Examples(
      "  ./upswing realaigym hardware run01.csv run02.csv.gz --json\n"
      "  ./upswing realaigym hardware sim_swingup.csv --score-version 3\n");
}

}  // namespace

void AddRealAiGym(CommandLine& line) {
  AddScore(line.Subcommand("score", "Score a policy in simulation or on a twin"));
  AddHardware(line.Subcommand("hardware", "Score logs of the real robot"));
  line.Examples(
      "  ./upswing realaigym score runs/pendubot-seed1\n"
      "  ./upswing realaigym hardware logs/*.csv.gz\n"
      "  ./upswing realaigym score --help     show all options of score\n");
}

}  // namespace upswing::realaigym
