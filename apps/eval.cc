#include <fmt/format.h>

#include <functional>

#include "apps/commands.h"
#include "apps/eval_table.h"
#include "apps/progress.h"
#include "core/error.h"
#include "core/text.h"
#include "core/thread_pool.h"
#include "io/machine.h"
#include "io/streams.h"
#include "run/find_policy.h"
#include "setup/arguments.h"
#include "setup/config.h"
#include "setup/loaded_policy.h"

namespace upswing {
namespace {

struct EvalArguments {
  PolicyArguments policy;
  std::string episodes_csv;
  TrialArguments trial;
  int64_t episodes = 100, threads = 0;
  bool as_json = false;
};

int RunEval(const EvalArguments& a) {
  const bool to_output = IsStandardStream(a.episodes_csv);
  if (to_output && a.as_json) {
    throw BadInput("--json: expected a file of its own for --episodes-csv, got - for it");
  }
  if (!a.episodes_csv.empty()) CheckWritable("--episodes-csv", a.episodes_csv);
  const LoadedPolicy loaded = GetPolicy(a.policy);
  ThreadPool pool(ResolveThreads(a.threads), a.threads == 0);
  const EvalReport report = [&] {
    EpisodeProgress progress(a.as_json);  // gone when the table is printed
    return EvaluatePolicy(loaded, a.trial, a.episodes, pool, std::ref(progress));
  }();
  if (!a.episodes_csv.empty()) WriteOutput(a.episodes_csv, EpisodesCsv(report));
  if (to_output) return 0;  // the rows alone, for a reader
  if (a.as_json) {
    fmt::print("{}\n", EvalJson(report));
  } else {
    PrintEvalTable(report);
  }
  if (!a.episodes_csv.empty() && !a.as_json) {
    fmt::print("  written        {}\n", Printable(a.episodes_csv));
  }
  return 0;
}

}  // namespace

void AddEval(CommandLine& line) {
  EvalArguments& a = line.Runs(RunEval);
  AddPolicy(line, a.policy);
  line.Require("policy");
  Options own;
  DescribeEvalEpisodes(own, &a.episodes);
  line.Arguments(own);
  line.Text("--episodes-csv", a.episodes_csv, "FILE",
            "table to write, a row for each episode: start, plant and figures; "
            "-: standard output, instead of the table of figures");
  AddTrialOptions(line, a.trial, "start states, noise and random plants");
  line.Flag("--known-plant", a.trial.known_plant,
            "a controller is made anew for the plant of each episode: what knowing it brings");
  AddThreads(line, a.threads);
  line.Flag("--json", a.as_json, "print JSON instead of a table");
  line.Footer(fmt::format(
      "An episode of the double pendulum lasts {} s from hanging with normal noise of 0.1 (rad,\n"
      "rad/s). It succeeds if both links are within 30° of upright for the whole of the last {} "
      "s.\n"
      "The return is the undiscounted sum of the reward, standard weights, over the first {} s.\n"
      "Settled is a link within 9° of upright. Steady tilt, chatter and torque once upright are "
      "over\n"
      "successful episodes. docs/task.md has the other tasks.\n\n"
      "Examples:\n"
      "  ./upswing eval runs/d3qn-seed1\n"
      "  ./upswing eval policy.safetensors --episodes 1000 --seed 7 --json\n"
      "  ./upswing eval runs/d3qn-seed1 --set mass2=1.05 --set gravity=9.7\n"
      "  ./upswing eval runs/d3qn-seed1 --sensor-noise 0.02 --delay 0.02\n"
      "  ./upswing eval runs/d3qn-seed1 --randomize 0.25 --episodes 1000   share of a box of "
      "plants\n"
      "  ./upswing eval runs/d3qn-seed1 --randomize 0.25 --episodes-csv episodes.csv\n"
      "  ./upswing plot runs/d3qn-seed1 --randomize 0.25 --episode 17      look at one of them\n"
      "  ./upswing eval mpc --randomize 0.25 --known-plant                 told each plant\n\n"
      "Instead of a file, a controller's name will do (docs/control.md): lqr holds the pendulum "
      "upright\n"
      "and does not swing it up; tvlqr follows a planned swing-up, mpc plans anew at each "
      "decision; "
      "pfl\n"
      "and energy pump energy until lqr catches; hybrid --swing-up POLICY lets lqr catch what was "
      "learned.\n"
      "--set takes mass1, mass2, length1, length2, damping1, damping2, gravity, torque_limit, and\n"
      "mass, length, damping for both. With --randomize each episode has its own plant, drawn from "
      "a\nbox around that one. Energy and height in the observation are scaled by the true plant "
      "of the\nepisode, which reveals it to the policy; with --unknown-plant by the plant of the "
      "training.\n",
      kEvaluationSeconds, kHoldSeconds, kReturnSeconds));
}

}  // namespace upswing
