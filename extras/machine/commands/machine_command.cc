#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/format.h"
#include "base/json.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/progress.h"
#include "cli/say.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/twin/identify.h"
#include "extras/machine/twin/length_by_motion.h"
#include "os/file.h"
#include "os/host.h"
#include "os/streams.h"
#include "report/figure.h"
#include "runs/plant_file.h"

namespace upswing::machine {

void AddLearn(CommandLine& line);  // in learn_command.cc

namespace {

struct MachineArguments {
  std::vector<std::string> logs;
  std::string columns, figure, plant, out, twin, csv;
  std::vector<std::string> against;
  int64_t folds = 5, threads = 0;
  double seconds = 0;  // 0: by the natural time of the machine
  bool as_json = false, one_body = false, overwrite = false;
};

void PrintCheck(const LogCheck& check) {
  fmt::print("{}: {} rows, {:.2f} s{}\n", Printable(check.name), check.rows, check.seconds,
             check.pieces > 1 ? fmt::format(" in {} pieces", check.pieces) : "");
  fmt::print("  {:<8} {}\n", "units", Printable(UnitsText(check.columns)));
  for (const Finding& finding : check.findings) {
    fmt::print("  {:<8} {:<11} {}{}\n", NameOf(finding.severity), AboutText(finding), finding.text,
               finding.rows ? ", " + RowsText(*finding.rows) : "");
  }
}

int RunCheck(const MachineArguments& a) {
  if (!a.figure.empty() && a.logs.size() > 1) {
    throw BadInput(Concat("--figure: expected one log with it, got ", a.logs.size()));
  }
  std::vector<LogCheck> checks;
  bool all_read = true;
  for (const std::string& file : a.logs) {
    try {
      const std::vector<MachineLog> pieces = ReadLog(file, a.columns);
      checks.push_back(CheckLog(file, pieces));
      if (!a.figure.empty()) DrawCheck(checks.back(), pieces, a.figure);
    } catch (const Error& error) {
      if (a.logs.size() == 1) throw;
      SayError(error.what());
      all_read = false;
      continue;
    }
    if (!a.as_json) PrintCheck(checks.back());
  }
  if (a.as_json) fmt::print("{}\n", CheckJson(checks));
  if (!a.figure.empty() && !a.as_json) fmt::print("written {}\n", Printable(a.figure));
  if (!all_read) return 2;
  return std::ranges::any_of(checks, &LogCheck::faulty) ? 1 : 0;
}

std::string ErrorText(const Estimate& e) {
  if (!e.interval) return fmt::format("{:.3f}", e.value);
  return fmt::format("{:.3f} ({:.3f}–{:.3f})", e.value, e.interval->low, e.interval->high);
}

void PrintErrors(std::span<const ErrorRow> rows, std::span<const Predictor> predictors,
                 const char* commanded) {
  size_t width = 8;
  for (const ErrorRow& row : rows) width = std::max(width, Columns(Printable(row.session)));
  std::string heads;
  for (const Predictor& p : predictors) heads += fmt::format("{:<22}", Printable(p.name));
  for (const bool reported : {false, true}) {
    if (std::ranges::none_of(rows, [&](const auto& r) { return r.reported == reported; })) continue;
    fmt::print("\nmedian error of the angles, rad (95% over runs), driven by {} torques\n",
               reported ? "reported" : commanded);
    fmt::print("  {:<{}}    s runs windows  {}\n", "", width, heads);
    for (const ErrorRow& row : rows) {
      if (row.reported != reported) continue;
      std::string cells;
      for (const Estimate& error : row.errors) cells += fmt::format("{:<22}", ErrorText(error));
      fmt::print("  {:<{}} {:>4} {:>4} {:>7}  {}\n",
                 row.session.empty() ? "all runs" : Printable(row.session), width,
                 FormatNumber(row.seconds), row.runs, row.windows, cells);
    }
  }
  if (predictors.size() < 2) return;
  fmt::print("\nerror smaller than {}'s by, % (95% over runs)\n",
             Printable(predictors.back().name));
  // A single session has no row for all runs: its own row has them.
  const bool has_all =
      std::ranges::any_of(rows, [](const ErrorRow& row) { return row.session.empty(); });
  for (const ErrorRow& row : rows) {
    if (has_all && !row.session.empty()) continue;
    const std::string session = row.session.empty() ? "all runs" : Printable(row.session);
    const std::string torques = row.reported ? "reported" : commanded;
    const auto [value, interval] = row.improvement;
    std::string improvement = fmt::format("{:.0f}", 100 * value);
    if (interval) {
      improvement += fmt::format(" ({:.0f}–{:.0f})", 100 * interval->low, 100 * interval->high);
    }
    fmt::print("  {}, {} s, {} torques: {}\n", session, FormatNumber(row.seconds), torques,
               improvement);
  }
}

/// Adds the models that --against names. A model whose name is taken gets its file as the name.
void AddOthers(std::span<const Twin> twins, const MachineArguments& a,
               std::span<const MachineLog> logs, std::vector<Predictor>& predictors) {
  for (size_t i = 0; i < twins.size(); ++i) {
    const bool is_taken =
        std::ranges::find(predictors, twins[i].name, &Predictor::name) != predictors.end();
    predictors.push_back(PredictorOf(is_taken ? a.against[i] : twins[i].name, twins[i], logs));
  }
}

/// Reads the models that --against names.
std::vector<Twin> ReadOthers(const MachineArguments& a) {
  std::vector<Twin> twins;
  for (const std::string& file : a.against) {
    if (std::ranges::count(a.against, file) > 1) {
      throw BadInput(Concat("--against: expected different files, got \"", Printable(file),
                            "\" more than once"));
    }
    twins.push_back(ReadTwin(file, "--against"));
  }
  return twins;
}

nlohmann::ordered_json ErrorsJson(std::span<const ErrorRow> rows,
                                  std::span<const Predictor> predictors, const char* commanded) {
  const auto json_of = [](const Estimate& e) {
    nlohmann::ordered_json json{{"value", e.value}};
    if (e.interval) json["interval"] = {e.interval->low, e.interval->high};
    return json;
  };
  auto list = nlohmann::ordered_json::array();
  for (const ErrorRow& row : rows) {
    nlohmann::ordered_json errors;
    for (size_t p = 0; p < predictors.size(); ++p) {
      errors[predictors[p].name] = json_of(row.errors[p]);
    }
    list.push_back({{"session", row.session},
                    {"seconds", row.seconds},
                    {"torques", row.reported ? "reported" : commanded},
                    {"runs", row.runs},
                    {"windows", row.windows},
                    {"median_error_rad", errors},
                    {"improvement", json_of(row.improvement)}});
  }
  return list;
}

/// Draws a comparison if asked. Prints it and the written files, or `json` with it.
void ShowErrors(const MachineArguments& a, std::span<const MachineLog> logs,
                std::span<const Predictor> predictors, std::span<const ErrorRow> rows,
                nlohmann::ordered_json json, ThreadPool& pool) {
  // The torques that drive predictions in place of reported ones.
  const char* commanded = HasCommands(logs) ? "commanded" : "no";
  if (!a.figure.empty()) DrawErrors(logs, predictors, a.figure, &pool);
  if (a.as_json) {
    json["errors"] = ErrorsJson(rows, predictors, commanded);
    fmt::print("{}\n", PrintableJson(json));
    return;
  }
  PrintErrors(rows, predictors, commanded);
  for (const std::string& written : {a.out, a.figure, a.csv}) {
    if (!written.empty()) fmt::print("written {}\n", Printable(written));
  }
}

nlohmann::ordered_json JudgementJson(const Judgement& j) {
  return {{"explains", NameOf(j.explanation)},
          {"sentence", SentenceOf(j)},
          {"windows", j.windows},
          {"seconds", j.seconds},
          {"noise_rad", j.noise},
          {"error_rad", j.error},
          {"times_noise", j.times_noise},
          {"unexplained_share", j.share},
          {"unexplained_share_of_steps", j.step_share}};
}

/// Says why a twin is not to be trusted, with the name of its file.
void SayDistrust(const std::string& file, const std::string& distrust) {
  SayError(Concat(Printable(file), ": not to be trusted: ", Printable(distrust)));
}

constexpr std::array kHorizons{0.2, 0.5, 1.0};

/// Reads the logs. Says a line about each one with faults, and then sets `is_doubtful`.
std::vector<MachineLog> ReadAndWarn(const MachineArguments& a, bool& is_doubtful) {
  return ReadCheckedLogs(a.logs, a.columns, [&](const std::string& fault) {
    SayError(fault);
    is_doubtful = true;
  });
}

/// Runs work that sets `is_doubtful` if its logs have faults, or no twin explains them. A later
/// error follows from these faults, and has exit code 1, too.
int RunOnLogs(void (*work)(const MachineArguments& a, bool& is_doubtful),
              const MachineArguments& a) {
  bool is_doubtful = false;
  try {
    work(a, is_doubtful);
  } catch (const Error& error) {
    if (!is_doubtful) throw;
    throw Failure(error.what());
  }
  return is_doubtful ? 1 : 0;
}

void Validate(const MachineArguments& a, bool& is_doubtful) {
  const std::string& file = a.twin;
  if (file.ends_with(".csv") || file.ends_with(".csv.gz")) {
    throw BadInput(Concat("machine validate: expected the twin's file before the logs, got \"",
                          Printable(file), "\""));
  }
  const Twin twin = ReadTwin(file, "machine validate");
  WarnOfDistrust(file, twin.distrust);
  const std::vector<Twin> others = ReadOthers(a);
  const std::vector<MachineLog> logs = ReadAndWarn(a, is_doubtful);
  std::vector<Predictor> predictors{PredictorOf(twin.name, twin, logs)};
  AddOthers(others, a, logs, predictors);
  ThreadPool pool(ResolveThreads(a.threads));
  const auto rows = CompareErrors(logs, predictors, kHorizons, &pool);
  if (rows.empty()) {
    throw BadInput(
        "machine validate: expected logs with a motion of 0.2 s away from upright, got none");
  }
  for (const MachineLog& log : logs) {
    if (!HasWindows(log, twin, kHorizons.front())) {
      SayError(Concat("warning: ", Printable(log.name), ": no motion of ", kHorizons.front(),
                      " s away from upright: left out"));
    }
  }
  if (!a.csv.empty()) WriteNamedFile(a.csv, MotionCsv(logs, predictors));
  const Judgement judgement = Judge(logs, predictors.front().twins, "these logs", &pool);
  const std::string contradiction = LengthContradiction(logs, twin, twin.plant.length1);
  if (!contradiction.empty()) SayError(Concat("warning: ", contradiction));
  if (!judgement.explains() || !contradiction.empty()) is_doubtful = true;
  if (!a.as_json) fmt::print("{}\n", SentenceOf(judgement));
  ShowErrors(a, logs, predictors, rows, {{"judgement", JudgementJson(judgement)}}, pool);
}

int RunValidate(const MachineArguments& a) { return RunOnLogs(Validate, a); }

/// A number with these decimals, or with three digits if they would show less of it.
std::string Decimals(double number, int decimals = 5) {
  const bool is_small = number != 0 && std::abs(number) < 10 * std::pow(10, -decimals);
  return is_small ? fmt::format("{:.3g}", number) : fmt::format("{:.{}f}", number, decimals);
}

void PrintTwin(const Identification& found) {
  const Twin& twin = found.fit.twin;
  const Options options = OptionsOf(twin);
  fmt::print("\nvalue                 ± standard deviation\n");
  for (const std::string& name : twin.uncertain) {
    const Option& option = *options.Get(name);
    const double variance = CovarianceOf(twin, name, name);
    if (variance > 0) {
      fmt::print("  {:<16} {:>10} ± {} {}\n", option.name, Decimals(option.number()),
                 Decimals(std::sqrt(variance)), option.unit);
    } else {
      fmt::print("  {:<16} {:>10}   {}, at its limit or not visible in the logs\n", option.name,
                 Decimals(option.number()), option.unit);
    }
  }
  fmt::print("  Masses and torques are taken as given: a motion shows only their ratios.\n");
  if (twin.sessions.empty()) return;
  fmt::print("\nsession                        ");
  for (const Session::Value& v : twin.sessions.front().values) fmt::print(" {:>8}", v.setting);
  for (const Session& s : twin.sessions) {
    fmt::print("\n  {:<30}", Shortened(Printable(s.name), 30));
    for (const Session::Value& v : s.values) fmt::print("{:>8} ", Decimals(v.number, 4));
  }
  fmt::print("\n");
}

void PrintIdentification(const Identification& found, size_t logs) {
  fmt::print("{} in {}; {}\n", Counted(found.fit.windows, "window"),
             Counted(static_cast<int64_t>(logs), "log"), SentenceOf(found.judgement));
  if (!found.structures.empty()) {
    fmt::print("\nmodel                                    error on left-out runs, {:.2g} s, rad\n",
               found.seconds);
    for (size_t s = 0; s < found.structures.size(); ++s) {
      fmt::print("{} {:<40} {:.4f}\n", static_cast<int>(s) == found.chosen ? "*" : " ",
                 found.structures[s].structure.name, found.structures[s].error);
    }
  }
  PrintTwin(found);
}

nlohmann::ordered_json IdentificationJson(const Identification& found, const std::string& file) {
  auto structures = nlohmann::ordered_json::array();
  for (const auto& [structure, error] : found.structures) {
    structures.push_back({{"name", structure.name}, {"left_out_error_rad", error}});
  }
  return {{"twin", file},
          {"windows", found.fit.windows},
          {"judgement", JudgementJson(found.judgement)},
          {"distrust", found.fit.twin.distrust},
          {"structures", structures},
          {"chosen", found.chosen}};
}

/// Warns of a twin that predicts worse than the values that the fit began with.
void WarnIfWorseThanStart(std::span<const ErrorRow> rows) {
  // The row of all runs and the longest predictions comes last.
  const ErrorRow* last = nullptr;
  for (const ErrorRow& row : rows) last = row.reported ? last : &row;
  if (last == nullptr || last->errors[0].value <= last->errors[1].value) return;
  SayError(
      fmt::format("warning: predictions over {} s are worse than those of the start, {:.3f} "
                  "against {:.3f} rad",
                  FormatNumber(last->seconds), last->errors[0].value, last->errors[1].value));
}

/// Warns of what a motion without torques cannot show.
void WarnOfFreeSwings(std::span<const MachineLog> logs, const Plant& plant) {
  if (HasCommands(logs)) return;
  const double center2 = LinksOf(plant)[1].c;
  SayError(
      Concat("warning: logs without torques show ratios of masses, not masses: center2 stays at ",
             fmt::format("{:.4g}", center2),
             " m; if that is wrong, center1, inertias and friction are, too"));
}

/// Whether the command is adapt, whose first guess is a prior twin; else identify, with --plant.
bool Adapts(const MachineArguments& a) { return a.plant.empty() && !a.twin.empty(); }

void CheckFitArguments(const MachineArguments& a) {
  constexpr double kShortestWindow = 0.01;  // s
  if (a.seconds != 0 && a.seconds < kShortestWindow) {
    throw BadInput(
        Concat("--seconds: expected 0, or ", kShortestWindow, " s or more, got ", a.seconds));
  }
  if (a.folds == 1) throw BadInput("--folds: expected 0, or 2 or more, got 1");
  CheckNewOutput("--out", a.out, a.overwrite);
}

/// Reads the twin or plant that the fit begins with. A plant file may leave out what the fit finds.
/// The defaults of the built-in plant would be wrong for other sizes.
Twin ReadFirst(const MachineArguments& a) {
  if (Adapts(a)) return ReadTwin(a.twin, "machine adapt");
  Twin first = ReadTwin(a.plant, "--plant");
  const std::vector<std::string> defaults = ReadPlantFile(a.plant).defaults;
  const auto is_left_out = [&](const char* name) {
    return std::ranges::find(defaults, name) != defaults.end();
  };
  if (is_left_out("damping1")) first.plant.damping1 = 0;
  if (is_left_out("damping2")) first.plant.damping2 = 0;
  if (is_left_out("armature")) first.plant.armature = 0;
  return first;
}

/// Fits a twin to the logs and shows the progress. The twin's name is that of --out.
Identification FitShowingProgress(const MachineArguments& a, std::span<const MachineLog> logs,
                                  const Twin& first, ThreadPool& pool) {
  IdentifyConfig config;
  config.folds = Adapts(a) ? 0 : static_cast<int>(a.folds);
  config.one_body = a.one_body;
  config.fit.adapts = Adapts(a);
  const double seconds = a.seconds > 0 ? a.seconds : ScaleOverUsual(first.plant).time;
  config.fit.windows.seconds = seconds;
  config.fit.windows.hop = seconds / 2;
  EpisodeProgress progress(a.as_json, "fits");
  Identification found = Identify(logs, first, config, &pool, std::ref(progress));
  found.fit.twin.name = std::filesystem::path(a.out).stem().string();
  return found;
}

/// The predictor of a fit. After a cross-validation it predicts runs that its twins have not seen.
Predictor PredictorOfFit(const Identification& found, std::span<const MachineLog> logs) {
  if (found.left_out.empty()) return PredictorOf("same runs", found.fit.twin, logs);
  return {"left-out runs", found.left_out};
}

/// Fits a twin to logs, writes it, and compares its predictions with those of the first guess.
void FitTwin(const MachineArguments& a, bool& is_doubtful) {
  CheckFitArguments(a);
  const Twin first = ReadFirst(a);
  WarnOfDistrust(Adapts(a) ? a.twin : a.plant, first.distrust);
  const std::vector<Twin> others = ReadOthers(a);
  const std::vector<MachineLog> logs = ReadAndWarn(a, is_doubtful);
  ThreadPool pool(ResolveThreads(a.threads));
  Identification found = FitShowingProgress(a, logs, first, pool);
  std::string& distrust = found.fit.twin.distrust;
  if (is_doubtful)
    distrust = Concat("its logs have faults", distrust.empty() ? "" : "; ", distrust);
  WriteNamedFile(a.out, TwinText(found.fit.twin));

  std::vector<Predictor> predictors{PredictorOfFit(found, logs),
                                    PredictorOf(first.name, first, logs)};
  AddOthers(others, a, logs, predictors);
  const auto rows = CompareErrors(logs, predictors, kHorizons, &pool);
  WarnIfWorseThanStart(rows);
  WarnOfFreeSwings(logs, found.fit.twin.plant);
  if (!distrust.empty()) SayDistrust(a.out, distrust);
  is_doubtful = !distrust.empty();
  if (!a.as_json) PrintIdentification(found, logs.size());
  ShowErrors(a, logs, predictors, rows, IdentificationJson(found, a.out), pool);
}

int RunIdentify(const MachineArguments& a) { return RunOnLogs(FitTwin, a); }

/// Checks the files to write before any work.
void CheckOutputs(const MachineArguments& a) {
  if (!a.figure.empty()) {
    CheckFigureName(a.figure);
    CheckWritable("--figure", a.figure);
    CheckCanDraw();
  }
  if (!a.csv.empty()) {
    CheckReplaceable("--csv", a.csv, "table of validate", {"log,time,measured 1,"});
  }
}

/// Adds the arguments that the commands share.
void AddLogs(CommandLine& line, MachineArguments& a, std::string_view figure) {
  line.Texts("log", a.logs, "LOG", "logs of a machine with two joints, .csv or .csv.gz");
  line.Require("log");
  line.Text("--columns", a.columns, "FILE",
            "TOML file that names the columns and units (default: those of RealAIGym)");
  line.Text("--figure", a.figure, "FILE", figure);
  line.Flag("--json", a.as_json, "print JSON instead of text");
  line.Check([&a] { CheckOutputs(a); });
}

/// Adds the arguments of predictions.
void AddPredictions(CommandLine& line, MachineArguments& a) {
  line.Repeated("--against", a.against, "FILE",
                "another twin or plant to compare with; repeat for more");
  AddThreads(line, a.threads);
}

void AddCheck(CommandLine& line) {
  MachineArguments& a = line.Runs(RunCheck);
  AddLogs(line, a, "figure of the log to draw, .svg or .png");
  line.Notes(
      "Prints a line for each finding. A note is a fact, such as the rate. A warning needs a\n"
      "look. A fault misleads an analysis of the log: degrees, swapped columns, a stuck\n"
      "encoder. Exit code: 0 without a fault, 1 with one, 2 if a log cannot be read.\n\n"
      "A file of columns:\n"
      "  time = {column = \"t\", unit = \"ms\"}         # s, ms, us, ns\n"
      "  angle1 = {column = \"theta1\", unit = \"deg\", hanging = 180}  # rad, deg, turn\n"
      "  angle2 = {column = \"theta2\", unit = \"deg\", wrap = 360, factor = -1}\n"
      "  velocity1 = \"omega1\"                       # rad/s, deg/s, turn/s, rpm\n"
      "  commanded1 = {column = \"u\", unit = \"mNm\"}   # Nm, mNm; also measured1, push1\n"
      "  piece = \"run\"        # a change of this column begins a separate piece\n"
      "  absolute = true      # joint 2 is measured against the vertical\n");
  line.Examples(
      "  ./upswing machine check trajectory.csv\n"
      "  ./upswing machine check logs/*.csv.gz --json\n"
      "  ./upswing machine check swing.csv --columns columns.toml --figure swing.svg\n");
}

void AddIdentify(CommandLine& line) {
  MachineArguments& a = line.Runs(RunIdentify);
  AddLogs(line, a, "figure of the prediction errors to draw, .svg or .png");
  line.Text("--plant", a.plant, "FILE|NAME",
            Concat("plant file with masses, lengths and first guesses, or shipped plant (",
                   Join(NamesOf(EmbeddedPlants()), ", "), ")"));
  line.Require("--plant");
  line.Text("--out", a.out, "FILE", "TOML file of the twin to write");
  line.Require("--out");
  AddOverwrite(line, a.overwrite);
  AddPredictions(line, a);
  line.Flag("--one-body", a.one_body, "give all sessions the same centres, inertias and armature");
  Options own;
  own.Add(&a.folds, "folds", {0, 100}, "",
          "number of folds of the cross-validation that chooses the model; 0: none");
  own.Add(&a.seconds, "seconds", {0, 10}, "s",
          "length of a window; 0: 1 s, counted in the natural time of machines of another size");
  line.Arguments(own);
  line.Notes(
      "Fits masses, centres, inertias, friction, delay and lag to windows of the logs. Each\n"
      "window has a free start state. The commanded torques drive the model; the reported\n"
      "ones are a second measurement. Cross-validation chooses the model. The twin's\n"
      "covariance includes the differences between sessions. If the plant file has slots and\n"
      "poles in a table [cogging], the fit finds the cogging of motors without gears.\n"
      "A sentence says how well the twin explains logs that the fit has not seen.\n"
      "Exit code: 0, or 1 if the twin is not to be trusted: it does not explain the logs, has a\n"
      "value that no machine has, or its logs have faults. The file then says why.\n");
  line.Examples(
      "  ./upswing machine identify logs/*.csv --plant realaigym-c1 --out twin.toml\n"
      "  ./upswing machine identify run1.csv run2.csv --plant arm.toml --out arm-twin.toml \\\n"
      "    --folds 0\n");
}

void AddAdapt(CommandLine& line) {
  MachineArguments& a = line.Runs(RunIdentify);
  line.Text("twin", a.twin, "TWIN", "twin of the machine on other days, or a plant file");
  line.Require("twin");
  AddLogs(line, a, "figure of the prediction errors to draw, .svg or .png");
  line.Text("--out", a.out, "FILE", "TOML file of today's twin to write");
  line.Require("--out");
  AddOverwrite(line, a.overwrite);
  AddPredictions(line, a);
  line.Notes(
      "Fits the twin of today to 10 to 30 s of today's logs. The covariance of TWIN says how\n"
      "much each value may change. A plant file has none: all values may change widely.\n"
      "Exit code: 0, or 1 if the twin is not to be trusted, as for machine identify.\n");
  line.Examples(
      "  ./upswing machine adapt twin.toml first.csv --out today.toml\n"
      "  ./upswing machine adapt realaigym-c1 run1.csv run2.csv --out today.toml\n"
      "  ./upswing machine validate today.toml later.csv --against twin.toml\n");
}

void AddValidate(CommandLine& line) {
  MachineArguments& a = line.Runs(RunValidate);
  line.Text("twin", a.twin, "TWIN", "twin or plant file");
  line.Require("twin");
  AddLogs(line, a, "figure of the prediction errors to draw, .svg or .png");
  line.Text("--csv", a.csv, "FILE",
            "CSV file to write, measured and predicted angles of 1 s of each log");
  AddPredictions(line, a);
  line.Notes(
      "Prints the median error of predictions over 0.2, 0.5 and 1 s, by session.\n"
      "A sentence says how well the twin explains the logs.\n"
      "Exit code: 0, or 1 if it does not explain them, or if they have faults.\n");
  line.Examples("  ./upswing machine validate twin.toml new/*.csv --against realaigym-c1\n");
}

}  // namespace

void AddMachine(CommandLine& line) {
  AddCheck(line.Subcommand("check", "Look for faults in logs"));
  AddIdentify(line.Subcommand("identify", "Fit a twin, a model of the machine, to logs"));
  AddLearn(line.Subcommand("learn", "Learn to balance a machine about which nothing is known"));
  AddAdapt(line.Subcommand("adapt", "Fit a twin to today's first logs"));
  AddValidate(line.Subcommand("validate", "Compare a twin's predictions with logs"));
  line.Examples(
      "  ./upswing machine check logs/*.csv.gz\n"
      "  ./upswing machine identify logs/*.csv --plant realaigym-c1 --out twin.toml\n"
      "  ./upswing machine adapt twin.toml today.csv --out today.toml\n"
      "  ./upswing machine validate twin.toml new/*.csv --against realaigym-c1\n"
      "  ./upswing machine identify --help     show all options of identify\n");
}

}  // namespace upswing::machine
