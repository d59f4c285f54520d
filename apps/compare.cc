#include "apps/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>

#include "apps/commands.h"
#include "core/file.h"
#include "core/text.h"
#include "report/learning_curve.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

struct CompareArguments {
  std::vector<std::string> runs;
  std::string out;
  bool unfinished = false, different_tasks = false, as_json = false;
};

/// The text of a CSV cell: quoted where it has to be.
std::string Cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

/// Median, IQM and its interval; what is not reached is `inf`, an interval of one run is empty.
std::string ScoreCells(const Scores& s) {
  const auto& interval = s.iqm.interval;
  return Concat(',', FormatNumber(s.median), ',', FormatNumber(s.iqm.value), ',',
                interval ? FormatNumber(interval->low) : "", ',',
                interval ? FormatNumber(interval->high) : "");
}

std::string SummaryCsv(const Comparison& comparison) {
  std::string csv = "group,seeds,solved,solved_low,solved_high";
  for (const auto& [name, scores] : NamedScores()) {
    csv += fmt::format(",{0}_median,{0}_iqm,{0}_low,{0}_high", name);
  }
  csv += ",evaluations_after_solved,of_them_steady,lowest_success_after_solved,task\n";
  for (size_t i = 0; i < comparison.summaries.size(); ++i) {
    const GroupSummary& s = comparison.summaries[i];
    const RunGroup& group = comparison.runs.groups[i];
    csv += Concat(Cell(group.label), ',', group.runs.size(), ',', s.solved, ',',
                  FormatNumber(s.solved_interval.low), ',', FormatNumber(s.solved_interval.high));
    for (const auto& [name, scores] : NamedScores()) csv += ScoreCells(s.*scores);
    csv += Concat(',', s.stability.evaluations, ',', s.stability.steady_evaluations, ',',
                  s.stability.evaluations > 0 ? FormatNumber(s.stability.lowest) : "", ',',
                  comparison.runs.tasks[i] + 1, '\n');
  }
  return csv;
}

std::string RunsCsv(const Comparison& comparison) {
  std::string csv = "group,run,seed,steps,seconds";
  for (const auto& [name, scores] : NamedScores()) csv += Concat(',', name);
  csv += '\n';
  for (size_t i = 0; i < comparison.summaries.size(); ++i) {
    const RunGroup& group = comparison.runs.groups[i];
    for (size_t k = 0; k < group.runs.size(); ++k) {
      const RunRecord& run = group.runs[k];
      csv += Concat(Cell(group.label), ',', Cell(run.path.string()), ',', run.plan.seed, ',',
                    run.evaluations.back().step, ',', FormatNumber(run.evaluations.back().seconds));
      for (const auto& [name, scores] : NamedScores()) {
        csv += Concat(',', FormatNumber((comparison.summaries[i].*scores).values[k]));
      }
      csv += '\n';
    }
  }
  return csv;
}

int RunCompare(const CompareArguments& arguments) {
  CompareRequest request;
  request.paths.assign(arguments.runs.begin(), arguments.runs.end());
  request.unfinished = arguments.unfinished;
  request.different_tasks = arguments.different_tasks;
  if (!arguments.out.empty()) {
    CheckFree(arguments.out);
    CheckCanDraw();
  }
  const Comparison comparison = Compare(request);
  if (!arguments.out.empty()) {
    MakeNewFolder(arguments.out);
    WriteComparison(comparison, arguments.out);
  }
  if (arguments.as_json) {
    fmt::print("{}\n", ComparisonJson(comparison));
  } else {
    PrintComparison(comparison, arguments.out);
  }
  return 0;
}

}  // namespace

size_t NumTasks(const Comparison& comparison) {
  return static_cast<size_t>(*std::ranges::max_element(comparison.runs.tasks)) + 1;
}

std::string CurvesName(size_t task) { return task == 0 ? "curves" : Concat("curves-", task + 1); }

std::span<const std::pair<const char*, Scores GroupSummary::*>> NamedScores() {
  static constexpr std::array<std::pair<const char*, Scores GroupSummary::*>, 6> kScores{{
      {"solve_seconds", &GroupSummary::solve_seconds},
      {"solve_steps", &GroupSummary::solve_steps},
      {"final_return", &GroupSummary::final_return},
      {"final_success", &GroupSummary::final_success},
      {"best_return", &GroupSummary::best_return},
      {"best_success", &GroupSummary::best_success},
  }};
  return kScores;
}

Comparison Compare(const CompareRequest& request) {
  Comparison comparison{GroupRuns(request), {}, {}};
  for (const RunGroup& group : comparison.runs.groups) {
    comparison.summaries.push_back(Summarize(group));
  }
  for (size_t b = 1; b < comparison.summaries.size(); ++b) {
    for (size_t a = 0; a < b; ++a) {
      if (comparison.runs.tasks[a] != comparison.runs.tasks[b]) continue;
      comparison.pairs.push_back(ComparePair(comparison.summaries, b, a));
    }
  }
  return comparison;
}

void WriteComparison(const Comparison& comparison, const fs::path& folder) {
  for (size_t task = 0; task < NumTasks(comparison); ++task) {
    std::vector<RunGroup> groups;
    for (size_t i = 0; i < comparison.runs.groups.size(); ++i) {
      if (static_cast<size_t>(comparison.runs.tasks[i]) != task) continue;
      groups.push_back(comparison.runs.groups[i]);
    }
    const Figure curves = LearningCurves(groups);
    Draw(curves, folder / Concat(CurvesName(task), ".svg"));
    Draw(curves, folder / Concat(CurvesName(task), ".png"));
  }
  WriteFileAtomically(folder / "summary.csv", SummaryCsv(comparison));
  WriteFileAtomically(folder / "runs.csv", RunsCsv(comparison));
}

void AddCompare(CLI::App& program, Command& command) {
  CLI::App* app = program.add_subcommand(
      "compare", "Compare trainings over their seeds, with intervals and curves");
  auto a = std::make_shared<CompareArguments>();
  app->add_option("runs", a->runs, "run folders, or folders that hold some")
      ->type_name("RUN|FOLDER")
      ->required()
      ->check(NotEmpty());
  app->add_option(
         "--out", a->out,
         "new folder for summary.csv, runs.csv, curves.svg and curves.png (curves-2 and so "
         "on for further tasks)")
      ->type_name("FOLDER")
      ->check(NotEmpty());
  app->add_flag("--unfinished", a->unfinished, "compare unfinished runs too, as they are")
      ->disable_flag_override();
  app->add_flag(
         "--different-tasks", a->different_tasks,
         "compare groups that are evaluated on different tasks (plant, disturbance, number of "
         "episodes) with each other as well")
      ->disable_flag_override();
  app->add_flag("--json", a->as_json, "print JSON")->disable_flag_override();
  app->footer(
      "Runs with the same settings but the seed are one group. Figures are over its runs: the\n"
      "interquartile mean (IQM) with a 95% bootstrap interval; docs/statistics.md defines each.\n"
      "A run that did not solve the task counts as one that needs more than its budget. Groups\n"
      "are compared with those that are evaluated on the same task. Broken and unfinished runs,\n"
      "and folders without a run, are left out with a note.\n\n"
      "Examples:\n"
      "  ./upswing compare runs/d3qn-seed*                  one agent over its seeds\n"
      "  ./upswing compare runs --out runs/comparison       all agents in runs, with figures\n"
      "  ./upswing compare study --json                     STUDY/VARIANT/SEED, for a program\n");
  app->callback([a, &command] { command = [a] { return RunCompare(*a); }; });
}

}  // namespace upswing
