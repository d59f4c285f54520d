#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "base/options.h"
#include "base/rng.h"
#include "base/thread_pool.h"
#include "extras/machine/twin.h"
#include "extras/realaigym/swing_policy.h"

namespace upswing::realaigym {

/// Separable natural evolution strategies: Schaul, Glasmachers, Schmidhuber, "High dimensions and
/// heavy tails for natural evolution strategies" (GECCO 2011). Candidates are normal about a mean,
/// with a deviation for each number. Mean and deviations follow the natural gradient of the ranks.
class Snes {
 public:
  Snes(std::vector<double> mean, std::vector<double> deviation, double mean_rate, uint64_t seed);

  /// Draws `population` candidates, an even number: pairs that mirror each other at the mean.
  const std::vector<std::vector<double>>& Ask(int population);
  /// Updates mean and deviations from the candidates' fitness; larger is better.
  void Tell(const std::vector<double>& fitness);

  const std::vector<double>& mean() const { return mean_; }
  const std::vector<double>& deviation() const { return deviation_; }

 private:
  std::vector<double> mean_, deviation_;
  double mean_rate_;
  Rng rng_;
  std::vector<std::vector<double>> z_, candidates_;
};

/// Settings of a search for a board policy.
struct BoardSearchConfig {
  std::string robot = NameOf(Robot::kPendubot);
  int64_t seed = 1, hidden = 16, starts = 12, alone = 250, generations = 1200, population = 64,
          first_population = 64;
  double deviation = 0.12, restart = 0.05, mean_rate = 2, performance_weight = 3, last_weight = 10;

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// A simulation drawn for a candidate.
struct DrawnEpisode {
  double weight;  // in the robustness; 0: the nominal plant
  BoardEpisode episode;
};

/// Searches a policy directly on the rules: first on the nominal plant only, then also on random
/// plants, delays, noise and pushes. Each generation draws these from the ranges of the robustness
/// score, but never uses the scored cases.
class BoardSearch {
 public:
  explicit BoardSearch(const BoardSearchConfig& config);
  /// Begins with a policy instead of a random network, and takes its robot and size.
  BoardSearch(const BoardSearchConfig& config, const SwingPolicy& first);
  /// Searches for a real machine: all simulations are of the twin's machine, and each generation
  /// draws machines of its posterior, with pushes (extras/realaigym/machine_trials.h). The policy
  /// becomes one that mirrors (swing_policy.h).
  void SearchOn(const Twin& twin) {
    twin_ = twin;
    net_ = SwingNet(net_.robot(), net_.hidden(), /*mirrors=*/true);
  }

  struct Report {
    int generation;  // counted over all starts
    int start;       // 1, 2, …; 0: random plants
    bool milestone;  // the last generation of a start, or every fiftieth
    double best_fitness;
  };

  /// Runs one generation; false after the last one.
  bool Step(ThreadPool* pool, Report& report);

  const SwingNet& net() const { return net_; }
  /// The current policy: the average of the last generations' means.
  const std::vector<double>& numbers() const { return average_; }
  /// The current policy's outcome on the nominal plant.
  BoardOutcome Nominal() const;
  int generation() const { return generation_; }
  int generations() const;

 private:
  /// Restarts from a random network.
  void Begin(int64_t start);
  std::vector<double> NominalFitnesses(const std::vector<std::vector<double>>& candidates,
                                       ThreadPool* pool) const;
  std::vector<double> Fitnesses(const std::vector<std::vector<double>>& candidates,
                                double performance_weight, ThreadPool* pool);

  std::vector<DrawnEpisode> DrawEpisodes();

  BoardSearchConfig config_;
  std::optional<Twin> twin_;
  SwingNet net_;
  Snes snes_;
  Rng rng_;
  double best_fitness_ = -1;
  std::vector<double> best_;  // mean of the best start
  std::vector<double> average_;
  int generation_ = 0;
};

}  // namespace upswing::realaigym
