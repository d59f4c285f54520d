#include "judge/bounds.h"

#include <mutex>

#include "base/csv.h"
#include "base/error.h"
#include "base/text.h"
#include "control/best_episode.h"
#include "rl/torque_levels.h"

namespace upswing {
namespace {

double SwingUpSeconds(const EvaluationEpisode& e, const EvaluationRule& rule) {
  return e.swing_up_seconds.value_or(rule.seconds);
}

}  // namespace

void BoundsConfig::Describe(Options& o) {
  o.Add(&episodes, "episodes", {1, 100000}, "", "number of episodes, the first ones of eval");
  o.Add(&torques, "torques", {3, 101}, "", "number of torque levels in the table");
  o.Add(&guesses, "guesses", {1, 10000}, "",
        "number of swing-ups from hanging that the search starts with");
}

void CheckComparable(const LoadedPolicy& loaded, const BoundsConfig& config) {
  if (!loaded.mjcf.empty()) {
    throw BadInput(Concat("bounds: expected policies of the built-in model, got ", loaded.name));
  }
  const Plant searched = TrialEnvironments(config.trial, nullptr).plants.front();
  const Plant judged = TrialEnvironments(config.trial, &loaded).plants.front();
  if (PlantValues(searched) == PlantValues(judged)) return;
  throw BadInput(Concat("bounds: expected a policy for ", PlantText(searched), ", got ",
                        loaded.name, " for ", PlantText(judged),
                        "; change the plant of the search with --plant or --set"));
}

EpisodeBounds FindBounds(const BoundsConfig& config, ThreadPool& pool, const Progress& progress) {
  const PendulumEnvConfig env = TrialEnvironments(config.trial, nullptr);
  const Plant& plant = env.plants.front();
  const EvaluationRule rule = PendulumSpec(env).evaluation;
  const auto n = static_cast<size_t>(config.episodes);

  const std::vector<TorqueTable> tables{{}, TorqueLevels(plant.torque_limit, config.torques)};
  double done = 0;
  std::mutex mutex;
  const auto show = [&](double, double) {
    const std::lock_guard lock(mutex);
    if (progress) progress(++done, static_cast<double>(config.guesses + config.episodes));
  };
  const BestEpisodeSearch search(plant, static_cast<int>(config.guesses), show);

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

}  // namespace upswing
