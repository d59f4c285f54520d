#include <fmt/format.h>

#include <filesystem>
#include <functional>

#include "apps/commands.h"
#include "apps/compare_report.h"
#include "apps/progress.h"
#include "core/error.h"
#include "core/text.h"
#include "core/thread_pool.h"
#include "io/file.h"
#include "io/machine.h"
#include "report/figure.h"
#include "run/find_policy.h"
#include "setup/controllers.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

struct CompareArguments {
  std::vector<std::string> names;  // of runs and policies
  PolicyArguments controllers;     // settings of those among them
  CompareRequest runs;             // but for its paths
  std::string out;
  int64_t threads = 0;
  bool as_json = false;
};

/// A controller, or a policy's file; anything else is to be a run or to hold some.
bool IsPolicy(const std::string& name) {
  const fs::path path = name;
  std::error_code error;
  return IsController(name) ||
         (path.extension() == ".safetensors" && !fs::is_directory(path, error));
}

/// Throws BadInput unless policies that are named have runs beside them, of one task each.
void CheckPolicies(const CompareArguments& a, const std::vector<std::string>& policies) {
  if (policies.empty()) return;
  const std::string names = Join(policies, " ");
  if (policies.size() == a.names.size()) {
    throw BadInput(Concat("compare: expected trainings beside ", names,
                          ", whose evaluations say on what to judge, got none (`upswing bounds ",
                          names, "` compares policies alone)"));
  }
  if (a.runs.different_tasks) {
    throw BadInput(Concat("--different-tasks: expected no policy beside it, as each is judged on ",
                          "the task of the runs, got ", names));
  }
}

int RunCompare(const CompareArguments& arguments) {
  CompareRequest request = arguments.runs;
  std::vector<std::string> policy_names;
  for (const std::string& name : arguments.names) {
    if (IsPolicy(name)) {
      policy_names.push_back(name);
    } else {
      request.paths.emplace_back(name);
    }
  }
  CheckPolicies(arguments, policy_names);
  if (!arguments.out.empty()) {
    CheckFree(arguments.out);
    CheckCanDraw();
  }
  const std::vector<LoadedPolicy> policies = GetPolicies(policy_names, arguments.controllers);
  Comparison comparison = Compare(request);
  if (!policies.empty()) {
    ThreadPool pool(ResolveThreads(arguments.threads));
    EpisodeProgress progress(arguments.as_json);
    const bool make_anew = arguments.controllers.made_for.empty();
    AddPolicies(policies, make_anew, pool, std::ref(progress), comparison);
  }
  if (arguments.as_json) {
    fmt::print("{}\n", ComparisonJson(comparison));
  } else {
    PrintComparison(comparison);
  }
  if (arguments.out.empty()) return 0;
  MakeNewFolder(arguments.out);
  WriteComparison(comparison, arguments.out);
  if (!arguments.as_json) PrintWritten(comparison, arguments.out);
  return 0;
}

}  // namespace

void AddCompare(CommandLine& line) {
  CompareArguments& a = line.Runs(RunCompare);
  line.Texts("runs", a.names, "RUN|FOLDER|POLICY",
             Concat("run folders, or folders that hold some; beside them policy.safetensors ",
                    "or controllers: ", Join(ControllerNames(), ", ")));
  line.Require("runs");
  AddControllers(line, a.controllers);
  line.Text("--out", a.out, "FOLDER",
            "new folder for summary.csv, runs.csv, policies.csv, curves.svg and curves.png "
            "(curves-2 and so on for further tasks)");
  line.Flag("--unfinished", a.runs.unfinished, "compare unfinished runs too, as they are");
  line.Flag("--different-tasks", a.runs.different_tasks,
            "compare groups that are evaluated on different tasks (plant, disturbance, number of "
            "episodes) with each other as well");
  AddThreads(line, a.threads);
  line.Flag("--json", a.as_json, "print JSON");
  line.Footer(
      "Runs with the same settings but the seed are one group. Figures are over its runs: the\n"
      "interquartile mean (IQM) with a 95% bootstrap interval; docs/statistics.md defines each.\n"
      "A run that did not solve the task counts as one that needs more than its budget. Groups\n"
      "are compared with those that are evaluated on the same task. Broken and unfinished runs,\n"
      "and folders without a run, are left out with a note.\n\n"
      "A policy's file or a controller has no seeds. It is judged on the episodes of the runs'\n"
      "final evaluations (of the first runs, up to 1,000 episodes), a controller made for their\n"
      "plant unless --made-for says otherwise; its return stands beside the runs', without an\n"
      "interval. mpc takes half a second of a processor for an episode.\n\n"
      "Examples:\n"
      "  ./upswing compare runs/d3qn-seed*                  one agent over its seeds\n"
      "  ./upswing compare runs --out runs/comparison       all agents in runs, with figures\n"
      "  ./upswing compare study --json                     STUDY/VARIANT/SEED, for a program\n"
      "  ./upswing compare runs/d3qn-seed* mpc tvlqr        beside classical control\n");
}

}  // namespace upswing
