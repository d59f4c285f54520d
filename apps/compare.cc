#include <fmt/format.h>

#include <memory>

#include "apps/commands.h"
#include "apps/compare_report.h"
#include "io/file.h"
#include "report/figure.h"

namespace upswing {
namespace {

struct CompareArguments {
  std::vector<std::string> runs;
  std::string out;
  bool unfinished = false, different_tasks = false, as_json = false;
};

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
