#include "judge/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "agents/controllers.h"
#include "base/format.h"
#include "base/json.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/progress.h"
#include "os/host.h"
#include "os/streams.h"
#include "runs/find_policy.h"
#include "runs/plant_file.h"

namespace upswing {
namespace {

struct BoundsArguments {
  BoundsConfig config;
  std::string plant;  // see ReadPlantFile
  std::vector<std::string> policies;
  std::vector<FlagValue> flags;  // includes the settings of controllers
  std::string csv;
  int64_t threads = 0;
  bool as_json = false;
};

/// A row of the table: the search or a policy.
struct BoundsRow {
  std::string name;
  Evaluation figures;  // of the episodes with the best return
  Quartiles swing_up_seconds;
};

/// `width` is the length of the longest name in columns.
std::string RowText(const BoundsRow& row, const BoundsRow& best, size_t width) {
  const double mean = row.figures.reward_sum.mean;
  std::string text =
      fmt::format("  {:<{}}  {:6.1f} ± {:5.1f} {:7.1f}%", Printable(row.name), width, mean,
                  row.figures.reward_sum.deviation, 100 * mean / best.figures.reward_sum.mean);
  if (row.figures.successes == 0) return text + "   no episode stays upright";
  return text + fmt::format("   {:.2f} s (+{:.2f} s)", row.swing_up_seconds.median,
                            row.swing_up_seconds.median - best.swing_up_seconds.median);
}

nlohmann::ordered_json RowJson(const BoundsRow& row, const BoundsRow& best) {
  const double mean = row.figures.reward_sum.mean;
  return {{"name", row.name},
          {"success_rate", row.figures.success_rate()},
          {"return", {{"mean", mean}, {"deviation", row.figures.reward_sum.deviation}}},
          {"share", mean / best.figures.reward_sum.mean},
          {"swing_up_seconds", row.swing_up_seconds.median}};
}

/// The design plant of the controllers among the policies; empty if there are none.
std::vector<std::string> MadeFor(const BoundsArguments& a) {
  return std::ranges::any_of(a.policies, IsController) ? a.config.trial.set
                                                       : std::vector<std::string>();
}

/// The arguments with the settings of the plant file before those of --set. The search knows the
/// plant and has no sensors, so that it leaves out the file's disturbance.
BoundsArguments WithPlant(BoundsArguments a) {
  if (a.plant.empty()) return a;
  std::vector<std::string> set;
  for (const FlagValue& flag : ReadPlantFile(a.plant).PlantFlags()) {
    set.push_back(Concat(flag.name, "=", flag.text));
  }
  a.config.trial.set.insert(a.config.trial.set.begin(), set.begin(), set.end());
  return a;
}

int RunBounds(const BoundsArguments& arguments) {
  const BoundsArguments a = WithPlant(arguments);
  if (!a.csv.empty()) CheckWritable("--csv", a.csv);
  // Controllers are designed for the plant of the search.
  const std::vector<LoadedPolicy> policies = GetPolicies(a.policies, {"", a.flags, MadeFor(a)});
  for (const LoadedPolicy& loaded : policies) CheckComparable(loaded, a.config);
  ThreadPool pool(ResolveThreads(a.threads));
  const EpisodeBounds bounds = [&] {
    EpisodeProgress progress(a.as_json);
    return FindBounds(a.config, pool, std::ref(progress));
  }();

  std::vector<BoundsRow> rows;
  const auto add = [&](const std::string& name, const BestEpisodes& best) {
    rows.push_back({name, Summarize(best.of_return, bounds.rule),
                    Summarize(best.of_time, bounds.rule).swing_up_seconds});
  };
  add("any torque", bounds.any);
  add(fmt::format("{} torques", a.config.torques), bounds.table);
  for (const LoadedPolicy& loaded : policies) {
    EpisodeProgress progress(a.as_json);
    const Evaluation figures =
        EvaluatePolicy(loaded, a.config.trial, a.config.episodes, pool, std::ref(progress)).figures;
    rows.push_back({loaded.name, figures, figures.swing_up_seconds});
  }
  if (!a.csv.empty()) WriteOutput(a.csv, BoundsCsv(bounds));
  if (a.as_json) {
    nlohmann::ordered_json j;
    for (const BoundsRow& row : rows) j["rows"].push_back(RowJson(row, rows.front()));
    fmt::print("{}\n", PrintableJson(j));
    return 0;
  }
  fmt::print("Best results found in {}, evaluated in {}\n", Counted(a.config.episodes, "episode"),
             a.config.trial.physics);
  size_t width = 0;
  for (const BoundsRow& row : rows) width = std::max(width, Printable(row.name).size());
  fmt::print("  {:<{}}  {:<14} {:>8}   median swing-up time\n", "", width, "return", "share");
  for (const BoundsRow& row : rows) fmt::print("{}\n", RowText(row, rows.front(), width));
  fmt::print(
      "  ± is the standard deviation over episodes. The best return and the shortest time come "
      "from\n"
      "  separate searches. A better result may exist.\n");
  return 0;
}

}  // namespace

void AddBounds(CommandLine& line) {
  BoundsArguments& a = line.Runs(RunBounds);
  line.Texts(
      "policy", a.policies, "POLICY|RUN",
      "policies to compare: policy.safetensors, run folders, shipped policies or controllers");
  ControllerConfig controllers;
  line.Settings(OptionsOf(controllers), a.flags);
  Options own;
  a.config.Describe(own);
  line.Arguments(own);
  AddPlant(line, a.plant);
  AddSet(line, a.config.trial.set, "change of the plant, such as mass2=1.2");
  AddSeed(line, a.config.trial.seed, "start states");
  AddPhysics(line, a.config.trial.physics);
  AddThreads(line, a.threads);
  line.Text("--csv", a.csv, "FILE", "CSV file to write, a row per episode");
  line.Flag("--json", a.as_json, "print JSON instead of a table");
  line.Footer(
      "The search knows the plant and each start state. It maximises the reward by\n"
      "box-constrained differential dynamic programming from many initial guesses. For a\n"
      "table of torques it rounds the result, then changes one torque at a time. The\n"
      "result is a lower bound of the best return and an upper bound of the shortest\n"
      "swing-up time. Episodes are those of eval.\n\n"
      "Examples:\n"
      "  ./upswing bounds\n"
      "  ./upswing bounds runs/d3qn-seed1 runs/sac-seed1 mpc\n"
      "  ./upswing bounds --episodes 10 --set torque_limit=4 --csv bounds.csv\n");
}

}  // namespace upswing
