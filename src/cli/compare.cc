#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/compare_report.h"
#include "os/file.h"

namespace upswing {
namespace {

struct CompareArguments {
  CompareRequest runs;
  std::string out;
  bool as_json = false;
};

int RunCompare(const CompareArguments& arguments) {
  if (!arguments.out.empty()) {
    CheckFree(arguments.out);
    SayIfNoFigures();
  }
  const Comparison comparison = Compare(arguments.runs);
  if (arguments.as_json) {
    fmt::print("{}\n", ComparisonJson(comparison));
  } else {
    PrintComparison(comparison);
  }
  if (arguments.out.empty()) return 0;
  MakeNewFolder(arguments.out);
  const std::vector<std::string> files = WriteComparison(comparison, arguments.out);
  if (!arguments.as_json) PrintWritten(files);
  return 0;
}

}  // namespace

void AddCompare(CommandLine& line) {
  CompareArguments& a = line.Runs(RunCompare);
  line.Texts("runs", a.runs.paths, "RUN|FOLDER", "runs or folders of runs");
  line.Require("runs");
  line.Text("--out", a.out, "FOLDER",
            "new folder for summary.csv, runs.csv, curves.svg and curves.png "
            "(curves-2, … for further tasks)");
  line.Flag("--unfinished", a.runs.unfinished,
            "compare unfinished runs too, up to their last evaluation");
  line.Flag("--different-tasks", a.runs.different_tasks,
            "compare also groups whose evaluations differ in plant, disturbance or number of "
            "episodes");
  line.Flag("--json", a.as_json, "print JSON");
  line.Notes(
      "Runs that differ only in the seed are one group. Figures are over the runs of a\n"
      "group: the interquartile mean (IQM) with a 95% bootstrap interval. A run that did\n"
      "not solve the task counts as one that needs more than its budget. Groups are\n"
      "compared if they are evaluated on the same task, in the order of their names. Groups of\n"
      "one name have their differences or their folder after it. A note names each broken or\n"
      "unfinished run and each folder without a run; they are left out.\n");
  line.Examples(
      "  ./upswing compare runs/d3qn-seed*               one agent over its seeds\n"
      "  ./upswing compare runs --out runs/comparison    all agents, with figures\n"
      "  ./upswing compare runs/post --json              a study, for another program\n");
}

}  // namespace upswing
