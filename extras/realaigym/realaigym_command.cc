#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include "base/error.h"
#include "base/format.h"
#include "base/json.h"
#include "base/sample.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "extras/machine/check.h"
#include "extras/machine/windows.h"
#include "extras/realaigym/boards.h"
#include "extras/realaigym/hardware.h"
#include "extras/realaigym/machine_trials.h"
#include "extras/realaigym/published_tvlqr.h"
#include "os/host.h"
#include "os/streams.h"
#include "report/figure.h"
#include "runs/find_policy.h"
#include "runs/tensor_file.h"

namespace upswing::realaigym {
namespace {

struct RealAiGymArguments {
  PolicyArguments policy;
  std::string figure, csv, search_out, from, twin;
  std::vector<std::string> hardware, law;
  int64_t draws = 1000;
  bool no_pushes = false;
  std::vector<FlagValue> search;
  int64_t threads = 0, case_seed = 1, runs = 100;
  std::string score_version = "2";
  bool as_json = false;
};

/// A number of a table; a dash if it is unknown.
std::string Cell(double x, int decimals, double factor = 1) {
  return std::isfinite(x) ? fmt::format("{:.{}f}", factor * x, decimals) : "–";
}

void PrintEntry(const BoardEntry& e) {
  fmt::print(
      "  {:<22} {:>6} {:>7} {:>6} {:>7} {:>7} {:>6}  {:>5} {:>5} {:>5} {:>5} {:>5} {:>5} "
      "{:>6}\n",
      Shortened(Printable(e.name), 22), Cell(e.seconds, 2), Cell(e.energy, 2),
      Cell(e.torque_cost, 2), Cell(e.smoothness, 4), Cell(e.velocity_cost, 1),
      Cell(e.performance, 3), Cell(e.rows[0], 1, 100), Cell(e.rows[1], 1, 100),
      Cell(e.rows[2], 1, 100), Cell(e.rows[3], 1, 100), Cell(e.rows[4], 1, 100),
      Cell(e.rows[5], 1, 100), Cell(e.robustness, 3));
}

void PrintReport(const BoardReport& report) {
  const Robot robot = report.competitor.robot;
  fmt::print("{} on RealAIGym's {}, simulation, version 2\n", Printable(report.competitor.name),
             NameOf(robot));
  fmt::print(
      "  {:<22} {:>6} {:>7} {:>6} {:>7} {:>7} {:>6}  {:>5} {:>5} {:>5} {:>5} {:>5} {:>5} {:>6}\n",
      "", "time", "energy", "cost", "smooth", "speed", "score", "model", "veloc", "torq.", "resp.",
      "delay", "push", "score");
  fmt::print("  {:<22} {:>6} {:>7} {:>6} {:>7} {:>7} {:>6}  {:>5} {:>5} {:>5} {:>5} {:>5} {:>5}\n",
             "", "s", "J", "N²m²s", "N·m", "rad²/s", "S", "%", "%", "%", "%", "%", "%");
  BoardEntry ours = report.Entry();
  ours.name = Printable(ours.name);
  PrintEntry(ours);
  fmt::print("  published\n");
  for (const BoardEntry& entry : PublishedEntries(robot)) PrintEntry(entry);
  if (!report.competitor.plant.empty()) {
    fmt::print("  designed for {}, not for the board's plant\n", report.competitor.plant);
  }
  fmt::print("  {} simulations of 10 s in {:.2f} s; largest torque {:.2f} N·m\n", kBoardSimulations,
             report.seconds, report.nominal.max_torque);
  if (!report.nominal.above_line) {
    fmt::print("  no swing-up: the tip is not above 0.45 m at the end\n");
  }
}

Competitor Search(const RealAiGymArguments& a, const std::optional<Twin>& twin, ThreadPool& pool) {
  BoardSearchConfig config;
  SetFlags(OptionsOf(config), a.search);
  BoardSearch search =
      a.from.empty() ? BoardSearch(config) : BoardSearch(config, LoadSwingPolicy(a.from));
  if (twin) search.SearchOn(*twin);
  InstallSignalHandlers("\nwriting the best policy so far\n");
  const auto begin = std::chrono::steady_clock::now();
  BoardSearch::Report report;
  {
    ProgressLine line;
    while (search.Step(&pool, report) && StopSignal() == 0) {
      const bool prints = !a.as_json && report.milestone;
      if (!prints && !line.due()) continue;
      const std::string stage = report.start > 0 ? fmt::format("start {}", report.start)
                                                 : fmt::format("generation {}", report.generation);
      const std::string text =
          fmt::format("{:<16}  S {:.3f}", stage, PerformanceScore(search.Nominal()));
      line.Show(static_cast<double>(report.generation) / search.generations(), {text});
      if (prints) line.Print(text);
    }
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  SaveTensors(search.net().ToTensors(search.numbers()), a.search_out);
  if (StopSignal() != 0) {
    Say("stopped at generation {} of {}: {}\n", search.generation(), search.generations(),
        Printable(a.search_out));
  } else if (!a.as_json) {
    Say("search took {}: {}\n", FormatDuration(seconds), Printable(a.search_out));
  }
  return CompetitorOf(search, a.search_out);
}

void PrintHardwareRow(const std::string& name, const std::string& success, double seconds,
                      const std::array<double, 5>& numbers) {
  fmt::print("  {:<36} {:>7} {:>6} {:>7} {:>7} {:>7} {:>7} {:>6}\n", Shortened(name, 36), success,
             Cell(seconds, 2), Cell(numbers[0], 2), Cell(numbers[1], 2), Cell(numbers[2], 3),
             Cell(numbers[3], 1), Cell(numbers[4], 3));
}

void PrintHardware(const HardwareReport& report) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const char* pushed = report.pushed ? " with pushes" : "";
  fmt::print("Runs of RealAIGym's {}{}, hardware, version 2\n", NameOf(report.robot), pushed);
  fmt::print("  {:<36} {:>7} {:>6} {:>7} {:>7} {:>7} {:>7} {:>6}\n", "", "success", "time",
             "energy", "cost", "smooth", "speed", "score");
  fmt::print("  {:<36} {:>7} {:>6} {:>7} {:>7} {:>7} {:>7} {:>6}\n", "", "", "s", "J", "N²m²s",
             "N·m", "rad²/s", "S");
  for (const HardwareRun& run : report.runs) {
    const BoardOutcome& o = run.outcome;
    PrintHardwareRow(Printable(run.name), o.above_line ? "yes" : "no",
                     o.above_line ? o.swing_up_seconds : kNone,
                     {o.energy, o.torque_cost, o.smoothness, o.velocity_cost, run.score});
  }
  PrintHardwareRow("mean", fmt::format("{}/{}", report.successes(), report.runs.size()), kNone,
                   {kNone, kNone, kNone, kNone, report.mean()});
  fmt::print("  published: measures of the best run, mean score of ten runs\n");
  for (const HardwareEntry& e : PublishedHardwareEntries(report.robot, report.pushed)) {
    PrintHardwareRow(e.name, fmt::format("{}/10", e.successes), e.seconds,
                     {e.energy, e.torque_cost, e.smoothness, e.velocity_cost, e.mean});
  }
  for (const HardwareRun& run : report.runs) {
    if (run.outcome.above_line) continue;
    fmt::print("  {}: {} after {:.2f} s\n", Printable(run.name),
               run.seconds < kHardwareSeconds ? "the run ends" : "the tip is not above 0.45 m",
               run.seconds);
  }
}

/// Successes of the twin's machines with the pushes of one run.
struct SuccessesOfRun {
  int successes = 0, machines = 0;
};

/// Splits trials, which take the pushes of `runs` runs in turn.
std::vector<SuccessesOfRun> SplitByRun(const HardwareReport& trials, size_t runs) {
  std::vector<SuccessesOfRun> split(runs);
  for (size_t i = 0; i < trials.runs.size(); ++i) {
    auto& [successes, machines] = split[i % runs];
    if (trials.runs[i].outcome.above_line) ++successes;
    ++machines;
  }
  return split;
}

/// Runs the TVLQR of the logs on a twin, and compares successes.
int CompareTvlqr(const RealAiGymArguments& a, std::span<const MachineLog> logs,
                 const HardwareReport& real) {
  if (a.no_pushes) throw BadInput("--no-pushes: expected no --hardware with it, whose logs decide");
  if (real.pushed && a.law.empty()) {
    throw BadInput("--law: expected runs without pushes to rebuild the TVLQR from, got none");
  }
  const Twin twin = ReadTwin(a.twin, "--twin");
  const std::vector<MachineLog> read = ReadCheckedLogs(a.law, "", [](const std::string&) {});
  const std::span<const MachineLog> of_law = a.law.empty() ? logs : read;
  if (!a.law.empty() && ScoreHardware(of_law, {}).robot != real.robot) {
    throw BadInput(Concat("--law: expected runs of the ", NameOf(real.robot), ", got others"));
  }
  const PublishedTvlqr law(of_law, real.robot);
  std::vector<double> misfits;
  for (const MachineLog& log : of_law) misfits.push_back(law.Misfit(log));
  const TrialRules rules{.count = static_cast<int>(a.draws),
                         .seed = static_cast<uint64_t>(a.case_seed)};
  ThreadPool pool(ResolveThreads(a.threads));
  HardwareReport report;
  {
    EpisodeProgress progress(a.as_json, "machines");
    report = RunTvlqrTrials(twin, real.robot, law, logs, rules, &pool, std::ref(progress));
  }
  int successes = real.successes(), runs = static_cast<int>(real.runs.size());
  for (const HardwareEntry& e : PublishedHardwareEntries(real.robot, real.pushed)) {
    if (e.name == "TVLQR") std::tie(successes, runs) = std::pair(e.successes, 10);
  }
  const Interval interval = WilsonInterval(successes, runs);
  const double share = report.successes() / static_cast<double>(a.draws);
  const std::vector<SuccessesOfRun> split =
      real.pushed ? SplitByRun(report, real.runs.size()) : std::vector<SuccessesOfRun>();
  if (a.as_json) {
    nlohmann::ordered_json json{{"robot", NameOf(real.robot)},
                                {"pushed", real.pushed},
                                {"law_misfit", Median(misfits)},
                                {"real_successes", successes},
                                {"real_runs", runs},
                                {"real_interval", {interval.low, interval.high}},
                                {"twin", share},
                                {"mean_score", report.mean()}};
    for (size_t k = 0; k < split.size(); ++k) {
      json["runs"].push_back({{"name", real.runs[k].name},
                              {"swung_up", real.runs[k].outcome.above_line},
                              {"twin_successes", split[k].successes},
                              {"twin_machines", split[k].machines}});
    }
    fmt::print("{}\n", PrintableJson(json));
    return 0;
  }
  fmt::print(
      "TVLQR of the {}{}, rebuilt from {} (commands differ by {:.3f} N·m)\n"
      "  real machine: {} of {} succeed, 95% interval {:.0f}–{:.0f}%\n"
      "  {}: {:.1f}% of {} succeed, mean score {:.3f}\n",
      NameOf(real.robot), real.pushed ? ", pushed" : "", Counted(of_law.size(), "run"),
      Median(misfits), successes, runs, 100 * interval.low, 100 * interval.high,
      Printable(twin.name), 100 * share, Counted(a.draws, "machine"), report.mean());
  if (!split.empty()) fmt::print("  with the pushes of a run {:>17} {:>14}\n", "real", "twin");
  for (size_t k = 0; k < split.size(); ++k) {
    const std::string name = std::filesystem::path(real.runs[k].name).filename().string();
    fmt::print("    {:<32} {:>8} {:>14}\n", Shortened(Printable(name), 32),
               real.runs[k].outcome.above_line ? "succeeds" : "fails",
               fmt::format("{} of {}", split[k].successes, split[k].machines));
  }
  return 0;
}

int ScoreLogs(const RealAiGymArguments& a) {
  BoardSearchConfig config;  // has --robot
  SetFlags(OptionsOf(config), a.search);
  const std::optional<Robot> robot = a.search.empty() ? std::nullopt : RobotNamed(config.robot);
  const std::vector<MachineLog> logs = ReadCheckedLogs(a.hardware, "", SayError);
  const HardwareReport report = ScoreHardware(logs, robot);
  if (!a.twin.empty()) return CompareTvlqr(a, logs, report);
  if (a.as_json) {
    fmt::print("{}\n", HardwareJson(report));
  } else {
    PrintHardware(report);
  }
  return 0;
}

/// Scores a competitor by score version 3.
int ScoreUptimes(const RealAiGymArguments& a, const Competitor& competitor, ThreadPool& pool) {
  UptimeReport report;
  {
    EpisodeProgress progress(a.as_json, "runs");
    report = ScoreUptime(competitor, static_cast<uint64_t>(a.case_seed), static_cast<int>(a.runs),
                         pool, std::ref(progress));
  }
  if (!a.csv.empty()) WriteOutput(a.csv, BoardCsv(report.trace));
  if (IsStandardStream(a.csv)) return 0;
  if (a.as_json) {
    fmt::print("{}\n", UptimeJson(report));
    return 0;
  }
  const auto [least, most] = std::ranges::minmax(report.runs, {}, &UptimeRun::score);
  double swing_ups = 0;
  for (const UptimeRun& run : report.runs) swing_ups += run.swing_ups;
  const Interval interval = report.interval();
  fmt::print(
      "{} on RealAIGym's {}, simulation, version 3\n"
      "  mean score {:.3f} (95%: {:.3f}–{:.3f}) of {}, {:.3f} to {:.3f}; {:.1f} swing-ups\n"
      "  published, one run each\n",
      Printable(report.competitor.name), NameOf(report.competitor.robot), report.scores.mean,
      interval.low, interval.high, Counted(report.runs.size(), "run"), least.score, most.score,
      swing_ups / static_cast<double>(report.runs.size()));
  for (const UptimeEntry& entry : PublishedUptimes(report.competitor.robot)) {
    fmt::print("  {:<22} {:>6.3f} {:>4} swing-ups\n", entry.name, entry.score, entry.swing_ups);
  }
  if (!a.csv.empty()) fmt::print("  written {}\n", Printable(a.csv));
  return 0;
}

/// Scores a competitor on machines drawn from a twin's posterior.
int ScoreOnTwin(const RealAiGymArguments& a, const Twin& twin, const Competitor& competitor,
                ThreadPool& pool) {
  const TrialRules rules{.count = static_cast<int>(a.draws),
                         .pushes = !a.no_pushes,
                         .seed = static_cast<uint64_t>(a.case_seed)};
  HardwareReport report;
  {
    EpisodeProgress progress(a.as_json, "machines");
    report = RunTrials(twin, competitor.robot, OnMachine(competitor.make, twin, competitor.robot),
                       rules, &pool, std::ref(progress));
  }
  const Interval interval = WilsonInterval(report.successes(), a.draws);
  if (a.as_json) {
    fmt::print("{}\n", PrintableJson({{"policy", competitor.name},
                                      {"twin", twin.name},
                                      {"pushed", report.pushed},
                                      {"draws", a.draws},
                                      {"successes", report.successes()},
                                      {"interval", {interval.low, interval.high}},
                                      {"mean_score", report.mean()}}));
    return 0;
  }
  fmt::print(
      "{} on {} of {}{}: {} of {} swing up and stay, {:.1f}% (95%: {:.1f}–{:.1f}%), mean "
      "score {:.3f}\n",
      Printable(competitor.name), Counted(a.draws, "machine"), Printable(twin.name),
      report.pushed ? ", pushed" : "", report.successes(), a.draws,
      100.0 * report.successes() / static_cast<double>(a.draws), 100 * interval.low,
      100 * interval.high, report.mean());
  if (twin.covariance.empty()) {
    fmt::print("  all machines are equal, because the twin has no [covariance]\n");
  }
  return 0;
}

int RunRealAiGym(const RealAiGymArguments& a) {
  if (!a.hardware.empty()) {
    const bool own_flags =
        std::ranges::all_of(a.search, [](const FlagValue& flag) { return flag.name == "robot"; });
    if (own_flags && a.policy.empty() && a.search_out.empty() && a.from.empty() &&
        a.figure.empty() && a.csv.empty()) {
      return ScoreLogs(a);
    }
    throw BadInput("--hardware: expected no policy, --search, --from, --figure or --csv with it");
  }
  const bool searches = !a.search_out.empty();
  if (searches == !a.policy.empty()) {
    throw BadInput(searches
                       ? "--search: expected no policy with it"
                       : "realaigym: expected a policy to score, --search FILE or --hardware LOG, "
                         "got none");
  }
  if (IsStandardStream(a.search_out)) throw BadInput("--search: expected a file, got -");
  if (!searches && !a.from.empty())
    throw BadInput("--from: expected --search FILE with it, got none");
  std::string robot;
  for (const FlagValue& flag : a.search) {
    constexpr std::array kOfFrom{"robot", "hidden", "starts", "alone", "first_population"};
    if (!a.from.empty() && std::ranges::count(kOfFrom, flag.name) > 0) {
      throw BadInput(
          Concat(FlagOf(flag.name), ": expected none with --from, which starts from a policy"));
    }
    if (flag.name == "robot") robot = flag.text;
    if (searches || flag.name == "robot") continue;
    throw BadInput(Concat(FlagOf(flag.name), ": expected --search FILE with it, got none"));
  }
  for (const auto& [flag, path] :
       {std::pair{"--search", &a.search_out}, {"--csv", &a.csv}, {"--figure", &a.figure}}) {
    if (!path->empty()) CheckWritable(flag, *path);
  }
  if (!a.twin.empty() && !(a.csv.empty() && a.figure.empty())) {
    throw BadInput("--twin: expected no --csv or --figure with it");
  }
  if (!a.figure.empty()) CheckFigureName(a.figure);
  const bool to_output = IsStandardStream(a.csv);
  if (to_output && a.as_json) {
    throw BadInput(
        "--json: expected a file for --csv, got - (standard output), where the JSON goes");
  }
  if (!a.figure.empty()) CheckCanDraw();
  ThreadPool pool(ResolveThreads(a.threads));
  std::optional<Twin> twin;
  if (!a.twin.empty()) twin = ReadTwin(a.twin, "--twin");
  const Competitor competitor =
      searches ? Search(a, twin, pool) : GetCompetitor(a.policy, robot, twin);
  if (StopSignal() != 0) return 128 + StopSignal();
  if (twin) return ScoreOnTwin(a, *twin, competitor, pool);
  if (a.score_version == "3") return ScoreUptimes(a, competitor, pool);
  BoardReport report;
  {
    EpisodeProgress progress(a.as_json);
    report = ScoreOnBoard(competitor, static_cast<uint64_t>(a.case_seed), pool, std::ref(progress));
  }
  if (!a.csv.empty()) WriteOutput(a.csv, BoardCsv(report.trace));
  if (!a.figure.empty()) DrawBoard(report, a.figure);
  if (to_output) return 0;
  if (a.as_json) {
    fmt::print("{}\n", BoardJson(report));
    return 0;
  }
  PrintReport(report);
  for (const std::string& file : {a.csv, a.figure}) {
    if (!file.empty()) fmt::print("  written {}\n", Printable(file));
  }
  return 0;
}

}  // namespace

void AddRealAiGym(CommandLine& line) {
  RealAiGymArguments& a = line.Runs(RunRealAiGym);
  AddPolicy(line, a.policy);
  line.Text("--search", a.search_out, "FILE",
            "policy file to write: search a policy, then score it");
  line.Text("--from", a.from, "FILE", "policy that the search starts from (default a random one)");
  line.Texts("--hardware", a.hardware, "LOG",
             "logs of runs on the real robot to score by the hardware rules, .csv or .csv.gz");
  line.Texts("--law", a.law, "LOG",
             "with --hardware and --twin: runs without pushes to rebuild the TVLQR from");
  line.Text("--twin", a.twin, "FILE",
            "score or search on machines drawn from this twin, by the hardware rules");
  line.Flag("--no-pushes", a.no_pushes, "no pushes on the twin's machines");
  line.Text("--figure", a.figure, "FILE", "figure of the robustness score to draw, .svg or .png");
  line.Text("--csv", a.csv, "FILE",
            "CSV file to write, the motion in the format of RealAIGym; -: standard output, without "
            "a table");
  line.Flag("--json", a.as_json, "print JSON instead of a table");
  Options own;
  own.Section("cases");
  own.Add(&a.case_seed, "case_seed", {0, 1e15}, "",
          "seed of noise and pushes in the robustness score, and of a twin's machines");
  own.AddChoice(
      &a.score_version, "score_version", {"2", "3"},
      "rules; 2: performance and robustness, 3: share of 60 s upright after random resets");
  own.Add(&a.runs, "runs", {1, 1e6}, "", "number of runs by score version 3");
  own.Add(&a.draws, "draws", {1, 1e6}, "", "number of machines drawn from the twin");
  line.Arguments(own);
  BoardSearchConfig config;
  line.Settings(OptionsOf(config), a.search);
  AddThreads(line, a.threads);
  line.Check([&line] {
    for (const std::string flag : {"--law", "--draws", "--no-pushes"}) {
      if (line.Has(flag) && !line.Has("--twin")) {
        throw BadInput(Concat(flag, ": expected --twin FILE with it, got none"));
      }
    }
  });
  line.Footer(
      "Performance: one simulation of 10 s from hanging, on RealAIGym's plant C.1 without\n"
      "friction, at 500 Hz. Robustness: 722 simulations with model errors, noise on\n"
      "velocities and torque, a motor that responds too little or too much, delay and\n"
      "pushes; each score is the share of simulations that end upright. A policy with a\n"
      "longer control period keeps its period. These results are simulated.\n\n"
      "--hardware scores logs of the real robot. The joint with more torque has the motor,\n"
      "unless --robot names the robot. A log with tau_pert belongs to the board with pushes.\n"
      "With --twin, the TVLQR of these runs also runs on machines drawn from the twin.\n\n"
      "--twin designs a controller for the twin without dry friction; --made-for changes this\n"
      "plant. The motors compensate " +
      fmt::format("{:.0f}%", 100 * kCompensated) +
      " of the estimated dry friction.\n"
      "A policy of --search --twin mirrors: beyond upright, |q1| > 180°, it swings back.\n\n"
      "Examples:\n"
      "  ./upswing realaigym --search pendubot.safetensors         takes some minutes\n"
      "  ./upswing realaigym pendubot.safetensors --figure rows.svg\n"
      "  ./upswing realaigym --search better.safetensors --from pendubot.safetensors\n"
      "  ./upswing realaigym --search acrobot.safetensors --robot acrobot --seed 2\n"
      "  ./upswing realaigym pendubot.safetensors --csv sim_swingup.csv --json\n"
      "  ./upswing realaigym baseline-lqr              the regulator of the baselines\n"
      "  ./upswing realaigym --hardware run01.csv run02.csv.gz --json\n"
      "  ./upswing realaigym pendubot.safetensors --twin realaigym-twin\n"
      "  ./upswing realaigym tvlqr --lqr-q1 100 --lqr-q2 100 --twin realaigym-twin\n");
}

}  // namespace upswing::realaigym
