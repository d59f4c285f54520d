#pragma once

#include <span>
#include <vector>

#include "control/lqr_catch.h"
#include "control/trajectory.h"
#include "control/tvlqr.h"

/// The best return and the least swing-up time of an episode that a search finds, knowing the plant
/// and where it starts. Nothing says that there is no better: they bound the best return from below
/// and the least time from above.
namespace upswing {

/// Torques from the start on; when they end, upright is near and the regulator holds.
struct BestEpisode {
  StateVector start;
  std::vector<double> torques;  // N·m, one for each control period
  double reward_sum = 0;        // return, over the first kReturnSeconds
  double swing_up_seconds = 0;  // start of the stretch that is inverted up to the end of those
};

/// What a search is after.
enum class Aim { kReturn, kTime };

/// Finds episodes of one plant. By continuation: box-DDP on the regulator's cost from sine waves of
/// many lengths, then on the reward itself, smooth at first and sharper each time (RewardCost). For
/// a table of torques the result is rounded under feedback, and each step's torque is then changed
/// as long as that helps.
class BestEpisodeSearch {
 public:
  /// `levels`: the torques that there are (N·m), ascending; empty: any within the limit. Searches
  /// from hanging with `guesses` sine waves. Throws as SolveLqr, and BadInput if none swings up.
  BestEpisodeSearch(const Plant& plant, std::vector<double> levels, int guesses);

  /// The best that is found of an episode from `start`, beginning with what is best from hanging
  /// and its mirror image.
  BestEpisode From(const StateVector& start, Aim aim);

  /// The torque (N·m) with which the regulator holds upright: limited, and one of the levels.
  double Hold(const StateVector& deviation) const;

  const Plant& plant() const { return plant_; }

 private:
  /// A trajectory with a better return by these weights, from one that swings up.
  Trajectory Sharpen(const Trajectory& trajectory, const RewardWeights& weights);
  /// The episodes of some sequences of torques from one start.
  std::vector<BestEpisode> Judge(const StateVector& start,
                                 std::span<const std::vector<double>> torques,
                                 const RewardWeights& weights);
  BestEpisode Judge(const StateVector& start, const std::vector<double>& torques,
                    const RewardWeights& weights = {}) {
    return Judge(start, {&torques, 1}, weights)[0];
  }
  /// The nearest torques of the table, under feedback about the trajectory, up to the regulator's
  /// region of attraction.
  std::vector<double> Round(const Trajectory& trajectory);
  /// Changes one torque of the table at a time, at most a hundred times, while that makes a better
  /// episode.
  BestEpisode Polish(BestEpisode episode, Aim aim);
  double Nearest(double torque) const;

  Plant plant_;
  std::vector<double> levels_;
  LqrCatch upright_;
  TrajectoryOptimizer optimizer_;
  Trajectory from_hanging_;  // with the best return
};

/// Acts as an episode says, then holds upright; for one environment.
class EpisodePolicy : public PendulumController {
 public:
  EpisodePolicy(BestEpisode episode, const BestEpisodeSearch& search)
      : PendulumController("best-episode", Options(), search.plant()),
        episode_(std::move(episode)),
        search_(search) {}

  std::string description() const override { return "the best episode that was found"; }
  std::unique_ptr<Memory> Start(int num_envs) const override {
    return std::make_unique<MemoryOf<size_t>>(num_envs, 0);
  }

 private:
  double Torque(const StateVector& deviation, size_t env, Memory& memory) const override {
    size_t& step = static_cast<MemoryOf<size_t>&>(memory).past[env];
    return step < episode_.torques.size() ? episode_.torques[step++] : search_.Hold(deviation);
  }

  BestEpisode episode_;
  const BestEpisodeSearch& search_;
};

}  // namespace upswing
