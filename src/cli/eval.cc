#include <fmt/format.h>

#include <cstdio>
#include <functional>

#include "agents/arguments.h"
#include "agents/controllers.h"
#include "agents/loaded_policy.h"
#include "base/error.h"
#include "base/text.h"
#include "base/thread_pool.h"
#include "cli/commands.h"
#include "cli/eval_table.h"
#include "cli/progress.h"
#include "os/host.h"
#include "os/streams.h"
#include "runs/find_policy.h"

namespace upswing {
namespace {

struct EvalArguments {
  std::vector<std::string> policies;
  PolicyArguments controllers;  // of the controllers among the policies
  std::string episodes_csv;
  TrialArguments trial;
  int64_t episodes = 100, threads = 0;
  bool as_json = false;
};

/// The evaluations of the policies, and the controllers without one.
struct Comparison {
  std::vector<EvalReport> reports;
  std::vector<Undesigned> undesigned;
};

/// The reasons for which controllers could not be designed, in a line.
std::string ReasonsOf(const std::vector<Undesigned>& undesigned) {
  std::vector<std::string> reasons;
  for (const auto& [name, reason] : undesigned) {
    const std::string prefix = Concat(name, ": ");
    reasons.push_back(reason.starts_with(prefix) ? reason : prefix + reason);
  }
  return Concat("not designed: ", Join(reasons, "; "));
}

/// Evaluates the policies on the same episodes. Of several, a controller that cannot be designed is
/// left out, unless none is left.
Comparison Evaluate(const EvalArguments& a) {
  Comparison comparison;
  auto& [reports, undesigned] = comparison;
  const bool several = a.policies.size() > 1;
  const std::vector<LoadedPolicy> policies =
      GetPoliciesIn(a.trial, a.policies, a.controllers, several ? &undesigned : nullptr);
  if (policies.empty()) throw Failure(ReasonsOf(undesigned));
  for (const LoadedPolicy& loaded : policies) {
    reports.push_back(PlanEvaluation(loaded, a.trial, a.episodes));
  }
  CheckSameEpisodes(reports);
  ThreadPool pool(ResolveThreads(a.threads), a.threads == 0);
  for (size_t i = 0; i < reports.size(); ++i) {
    EpisodeProgress progress(a.as_json);  // removed before the table is printed
    RunEvaluation(reports[i], policies[i], pool, std::ref(progress));
  }
  return comparison;
}

void PrintComparison(const EvalArguments& a, const Comparison& comparison) {
  const auto& [reports, undesigned] = comparison;
  const bool several = a.policies.size() > 1;
  if (a.as_json) {
    fmt::print("{}\n", several ? ComparisonJson(reports, undesigned) : EvalJson(reports.front()));
    return;
  }
  if (several) {
    PrintEvalComparison(reports, undesigned);
  } else {
    PrintEvalTable(reports.front());
  }
  if (!a.episodes_csv.empty()) fmt::print("  written        {}\n", Printable(a.episodes_csv));
}

int RunEval(const EvalArguments& a) {
  const bool to_output = IsStandardStream(a.episodes_csv);
  if (to_output && a.as_json) {
    throw BadInput(
        "--json: expected a file for --episodes-csv, got - (standard output), where the JSON goes");
  }
  if (!a.episodes_csv.empty()) {
    CheckReplaceable("--episodes-csv", a.episodes_csv, "table of episodes",
                     {"episode,", "policy,episode,"});
  }
  const Comparison comparison = Evaluate(a);
  if (!a.episodes_csv.empty()) {
    WriteOutput(a.episodes_csv, EpisodesCsv(comparison.reports, a.policies.size() > 1));
  }
  // The rows on standard output are for another program.
  if (!to_output) PrintComparison(a, comparison);
  std::fflush(stdout);
  if (!comparison.undesigned.empty()) throw Failure(ReasonsOf(comparison.undesigned));
  return 0;
}

/// A line about each controller.
std::string ControllerHelp() {
  std::string lines;
  for (const ControllerKind& kind : ControllerKinds()) {
    lines += fmt::format("  {:<6}  {}\n", kind.name, kind.help);
  }
  return lines;
}

}  // namespace

void AddEval(CommandLine& line) {
  EvalArguments& a = line.Runs(RunEval);
  line.Texts("policies", a.policies, "POLICY|RUN",
             Concat(PolicyWords(), "; several are compared on the same episodes"));
  line.Require("policies");
  AddControllers(line, a.controllers);
  Options own;
  DescribeEvalEpisodes(own, &a.episodes);
  line.Arguments(own);
  line.Text("--episodes-csv", a.episodes_csv, "FILE",
            "CSV file to write, a row per episode: start, plant and results; -: standard output, "
            "instead of the table");
  AddTrialOptions(line, a.trial, "start states, noise and random plants");
  line.Flag("--known-plant", a.trial.known_plant,
            "design a controller again for the plant of each episode, as if it knew the plant");
  AddThreads(line, a.threads);
  line.Flag("--json", a.as_json, "print JSON instead of a table");
  line.Examples(
      "  ./upswing eval runs/d3qn-seed1\n"
      "  ./upswing eval d3qn sac mpc runs/d3qn-seed1 --episodes 200\n"
      "  ./upswing eval policy.safetensors --episodes 1000 --seed 7 --json\n"
      "  ./upswing eval runs/d3qn-seed1 --mass2 1.05 --gravity 9.7\n"
      "  ./upswing eval runs/d3qn-seed1 --plant realaigym\n"
      "  ./upswing eval runs/d3qn-seed1 --sensor-noise 0.02 --delay 0.02\n"
      "  ./upswing eval runs/d3qn-seed1 --randomize 0.25 --episodes 1000\n"
      "  ./upswing eval runs/d3qn-seed1 --randomize 0.25 --episodes-csv episodes.csv\n"
      "  ./upswing plot runs/d3qn-seed1 --randomize 0.25 --episode 17\n"
      "  ./upswing eval mpc --randomize 0.25 --known-plant\n");
  line.Notes(fmt::format(
      "An episode of the double pendulum starts hanging, with normal noise of 0.1 (rad,\n"
      "rad/s), and lasts {} s. It succeeds if both links are within 30° of upright\n"
      "throughout the last {} s. The return is the undiscounted sum of the reward, with\n"
      "the standard weights, over the first {} s, weighted by the control period over the\n"
      "usual one (0.02 s, in natural time). A link within 9° of upright is settled.\n"
      "Steady tilt, chatter and torque once upright are means over successful episodes.\n"
      "Torque changes below a thousandth of the limit are no chatter.\n\n"
      "Several policies get the same episodes: start, plant and noise. The table and the JSON\n"
      "have the mean difference of each policy to the first, with a 95% bootstrap interval of\n"
      "pairs.\n"
      "All need one plant and one goal; --plant, --goal set them. A controller that cannot be\n"
      "designed gets a row with the reason, and the exit code is 1.\n\n"
      "Controllers:\n{}\n"
      "The plant's flags, such as --mass2 1.3, change it; --set mass2=1.3 does the same, and\n"
      "wins over the flag.\n"
      "With --randomize each episode draws its plant from a box around the nominal one. Observed\n"
      "energy and height are scaled by the episode's plant, which tells the policy of it; with\n"
      "--unknown-plant by the training's.\n",
      kEvaluationSeconds, kHoldSeconds, kReturnSeconds, ControllerHelp()));
}

}  // namespace upswing
