#include <fmt/format.h>

#include <filesystem>
#include <functional>

#include "agents/controllers.h"
#include "base/error.h"
#include "base/text.h"
#include "base/thread_pool.h"
#include "cli/commands.h"
#include "cli/compare_report.h"
#include "cli/progress.h"
#include "os/file.h"
#include "os/host.h"
#include "runs/find_policy.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

struct CompareArguments {
  std::vector<std::string> names;  // of runs and policies
  PolicyArguments controllers;     // settings of the controllers
  CompareRequest runs;             // without its paths
  std::string out;
  int64_t threads = 0;
  bool as_json = false;
};

/// Whether a name is a controller, a shipped policy or a policy file; other names are runs or
/// folders of runs.
bool IsPolicy(const std::string& name) {
  const fs::path path = name;
  std::error_code error;
  return IsController(name) || !ShippedPolicy(name).empty() ||
         (path.extension() == ".safetensors" && !fs::is_directory(path, error));
}

/// Throws BadInput if there are policies without runs, or with --different-tasks.
void CheckPolicies(const CompareArguments& a, const std::vector<std::string>& policies) {
  if (policies.empty()) return;
  const std::string names = Join(policies, " ");
  if (policies.size() == a.names.size()) {
    throw BadInput(Concat("compare: expected runs too, whose episodes ", names,
                          " can be evaluated on, got none (`upswing bounds ", names,
                          "` compares policies without runs)"));
  }
  if (a.runs.different_tasks) {
    throw BadInput(Concat("--different-tasks: expected no policy with it, because a policy is ",
                          "evaluated on the runs' task, got ", names));
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
    SayIfNoFigures();
  }
  const std::vector<LoadedPolicy> policies = GetPolicies(policy_names, arguments.controllers);
  Comparison comparison = Compare(request);
  if (!policies.empty()) {
    ThreadPool pool(ResolveThreads(arguments.threads));
    EpisodeProgress progress(arguments.as_json);
    const bool redesign = arguments.controllers.made_for.empty();
    AddPolicies(policies, redesign, pool, std::ref(progress), comparison);
  }
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
  line.Texts("runs", a.names, "RUN|FOLDER|POLICY",
             Concat("runs or folders of runs; with them also policies: policy.safetensors, shipped "
                    "policies or ",
                    "controllers (", Join(ControllerNames(), ", "), ")"));
  line.Require("runs");
  AddControllers(line, a.controllers);
  line.Text("--out", a.out, "FOLDER",
            "new folder for summary.csv, runs.csv, curves.svg and curves.png "
            "(curves-2, … for further tasks)");
  line.Flag("--unfinished", a.runs.unfinished,
            "compare unfinished runs too, up to their last evaluation");
  line.Flag("--different-tasks", a.runs.different_tasks,
            "compare also groups whose evaluations differ in plant, disturbance or number of "
            "episodes");
  AddThreads(line, a.threads);
  line.Flag("--json", a.as_json, "print JSON");
  line.Footer(
      "Runs that differ only in the seed are one group. Figures are over the runs of a\n"
      "group: the interquartile mean (IQM) with a 95% bootstrap interval. A run that did\n"
      "not solve the task counts as one that needs more than its budget. Groups are\n"
      "compared if they are evaluated on the same task. A note names each broken or\n"
      "unfinished run and each folder without a run; they are left out.\n\n"
      "A policy or controller has no seeds. It is evaluated on the episodes of the runs'\n"
      "final evaluations (of the first runs, up to 1,000 episodes). A controller is\n"
      "designed for the runs' plant unless --made-for changes that. Its return has no\n"
      "interval. mpc needs half a second of processor time per episode.\n\n"
      "Examples:\n"
      "  ./upswing compare runs/d3qn-seed*               one agent over its seeds\n"
      "  ./upswing compare runs --out runs/comparison    all agents, with figures\n"
      "  ./upswing compare runs/post --json              a study, for another program\n"
      "  ./upswing compare runs/d3qn-seed* mpc tvlqr     with classical control\n");
}

}  // namespace upswing
