#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <mutex>

#include "agents/controllers.h"
#include "base/csv.h"
#include "base/error.h"
#include "base/format.h"
#include "base/json.h"
#include "base/text.h"
#include "cli/commands.h"
#include "cli/progress.h"
#include "control/best_episode.h"
#include "judge/eval_report.h"
#include "os/host.h"
#include "os/streams.h"
#include "rl/torque_levels.h"
#include "runs/find_policy.h"
#include "runs/plant_file.h"

namespace upswing {
namespace {

struct BoundsArguments {
  TrialArguments trial;  // the plant, the engine and the seed of the starts
  int64_t episodes = 100, torques = 9, guesses = 24;
  std::string plant;  // see ReadPlantFile
  std::vector<std::string> policies;
  std::vector<FlagValue> flags;  // includes the settings of controllers
  std::string csv;
  int64_t threads = 0;
  bool as_json = false;
};

/// The best episode found for each start, judged in an engine: one for the return, one for the
/// swing-up time.
struct BestEpisodes {
  std::vector<EvaluationEpisode> of_return, of_time;  // (N)
};

/// Bounds on the return and swing-up time of the episodes of `eval`: the best episodes found with
/// any torque within the limit, and with a table of torques. An episode with the table also counts
/// for `any` if it is better. None is proved to be the best.
struct EpisodeBounds {
  EvaluationRule rule;
  std::vector<std::vector<double>> starts;  // (N, S)
  BestEpisodes any, table;
};

double SwingUpSeconds(const EvaluationEpisode& e, const EvaluationRule& rule) {
  return e.swing_up_seconds.value_or(rule.seconds);
}

/// Throws BadInput unless the policy's plant is the plant that the search uses.
void CheckComparable(const LoadedPolicy& loaded, const BoundsArguments& a) {
  if (!loaded.mjcf.empty()) {
    throw BadInput(Concat("bounds: expected policies of the built-in model, got ", loaded.name));
  }
  const Plant searched = TrialEnvironments(a.trial, nullptr).plants.front();
  const Plant judged = TrialEnvironments(a.trial, &loaded).plants.front();
  if (PlantValues(searched) == PlantValues(judged)) return;
  throw BadInput(Concat("bounds: expected a policy for ", PlantText(searched), ", got ",
                        loaded.name, " for ", PlantText(judged),
                        "; change the plant of the search with --plant or --set"));
}

/// Searches (control/best_episode.h), then judges the found episodes in the trial's engine.
/// `progress` counts guesses and episodes, which take about equally long. Throws BadInput, and as
/// BestEpisodeSearch does.
EpisodeBounds FindBounds(const BoundsArguments& a, ThreadPool& pool, const Progress& progress) {
  const PendulumEnvConfig env = TrialEnvironments(a.trial, nullptr);
  const Plant& plant = env.plants.front();
  const EvaluationRule rule = PendulumSpec(env).evaluation;
  const auto n = static_cast<size_t>(a.episodes);

  const std::vector<TorqueTable> tables{{}, TorqueLevels(plant.torque_limit, a.torques)};
  double done = 0;
  std::mutex mutex;
  const auto show = [&](double, double) {
    const std::lock_guard lock(mutex);
    progress(++done, static_cast<double>(a.guesses + a.episodes));
  };
  const BestEpisodeSearch search(plant, static_cast<int>(a.guesses), show);

  const BestEpisodes none{std::vector<EvaluationEpisode>(n), std::vector<EvaluationEpisode>(n)};
  EpisodeBounds bounds{rule, std::vector<std::vector<double>>(n), none, none};
  pool.ParallelFor(static_cast<int>(n), [&](int index) {
    const auto i = static_cast<size_t>(index);
    const auto [q1, q2, w1, w2] = OneEpisode(env, index).state(0);
    std::vector<double>& start = bounds.starts[i];
    start = {q1, q2, w1, w2};
    BestEpisodeSearch own = search;  // a copy per thread: it has buffers
    const auto found = own.From(StateVector(start.data()), tables);
    for (size_t k = 0; k < tables.size(); ++k) {
      const auto judged = [&](const BestEpisode& episode) {
        PendulumEnv one = OneEpisode(env, index);
        return EvaluateEpisodes(EpisodePolicy(episode, own, tables[k]), one).front();
      };
      BestEpisodes& best = k == 0 ? bounds.any : bounds.table;
      best.of_return[i] = judged(found[k].of_return);
      best.of_time[i] = judged(found[k].of_time);
    }
    // An episode with torques of the table counts for any torque, too.
    EvaluationEpisode& most = bounds.any.of_return[i];
    EvaluationEpisode& fastest = bounds.any.of_time[i];
    if (bounds.table.of_return[i].reward_sum > most.reward_sum) most = bounds.table.of_return[i];
    if (SwingUpSeconds(bounds.table.of_time[i], rule) < SwingUpSeconds(fastest, rule)) {
      fastest = bounds.table.of_time[i];
    }
    show(0, 0);
  });
  return bounds;
}

/// The bounds as CSV, one row for each episode.
std::string BoundsCsv(const EpisodeBounds& bounds) {
  CsvTable csv;
  for (size_t i = 0; i < bounds.starts.size(); ++i) {
    const std::vector<double>& start = bounds.starts[i];
    csv.Add("episode", i);
    csv.Add("q1", start[0]);
    csv.Add("q2", start[1]);
    csv.Add("w1", start[2]);
    csv.Add("w2", start[3]);
    csv.Add("return", bounds.any.of_return[i].reward_sum);
    csv.Add("swing_up_seconds", SwingUpSeconds(bounds.any.of_time[i], bounds.rule));
    csv.Add("return_table", bounds.table.of_return[i].reward_sum);
    csv.Add("swing_up_seconds_table", SwingUpSeconds(bounds.table.of_time[i], bounds.rule));
    csv.EndRow();
  }
  return csv.text();
}

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
  return std::ranges::any_of(a.policies, IsController) ? a.trial.set : std::vector<std::string>();
}

/// The arguments with the settings of the plant file before those of --set. The search knows the
/// plant and has no sensors, so that it leaves out the file's disturbance.
BoundsArguments WithPlant(BoundsArguments a) {
  if (a.plant.empty()) return a;
  std::vector<std::string> set;
  for (const FlagValue& flag : ReadPlantFile(a.plant).PlantFlags()) {
    set.push_back(Concat(flag.name, "=", flag.text));
  }
  a.trial.set.insert(a.trial.set.begin(), set.begin(), set.end());
  return a;
}

int RunBounds(const BoundsArguments& arguments) {
  const BoundsArguments a = WithPlant(arguments);
  if (!a.csv.empty()) CheckWritable("--csv", a.csv);
  // Controllers are designed for the plant of the search.
  const std::vector<LoadedPolicy> policies = GetPolicies(a.policies, {"", a.flags, MadeFor(a)});
  for (const LoadedPolicy& loaded : policies) CheckComparable(loaded, a);
  ThreadPool pool(ResolveThreads(a.threads));
  const EpisodeBounds bounds = [&] {
    EpisodeProgress progress(a.as_json);
    return FindBounds(a, pool, std::ref(progress));
  }();

  std::vector<BoundsRow> rows;
  const auto add = [&](const std::string& name, const BestEpisodes& best) {
    rows.push_back({name, Summarize(best.of_return, bounds.rule),
                    Summarize(best.of_time, bounds.rule).swing_up_seconds});
  };
  add("any torque", bounds.any);
  add(fmt::format("{} torques", a.torques), bounds.table);
  for (const LoadedPolicy& loaded : policies) {
    EpisodeProgress progress(a.as_json);
    const Evaluation figures =
        EvaluatePolicy(loaded, a.trial, a.episodes, pool, std::ref(progress)).figures;
    rows.push_back({loaded.name, figures, figures.swing_up_seconds});
  }
  if (!a.csv.empty()) WriteOutput(a.csv, BoundsCsv(bounds));
  if (a.as_json) {
    nlohmann::ordered_json j;
    for (const BoundsRow& row : rows) j["rows"].push_back(RowJson(row, rows.front()));
    fmt::print("{}\n", PrintableJson(j));
    return 0;
  }
  fmt::print("Best results found in {}, evaluated in {}\n", Counted(a.episodes, "episode"),
             a.trial.physics);
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
  line.Texts("policy", a.policies, "POLICY|RUN", Concat("policies to compare: ", PolicyWords()));
  ControllerConfig controllers;
  line.Settings(OptionsOf(controllers), a.flags);
  Options own;
  own.Add(&a.episodes, "episodes", {1, 100000}, "", "number of episodes, the first ones of eval");
  own.Add(&a.torques, "torques", {3, 101}, "", "number of torque levels in the table");
  own.Add(&a.guesses, "guesses", {1, 10000}, "",
          "number of swing-ups from hanging that the search starts with");
  line.Arguments(own);
  AddPlant(line, a.plant);
  AddSet(line, a.trial.set);
  AddSeed(line, a.trial.seed, "start states");
  AddPhysics(line, a.trial.physics);
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
