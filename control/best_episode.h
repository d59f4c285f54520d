#pragma once

#include <span>
#include <vector>

#include "control/lqr_catch.h"
#include "control/trajectory.h"
#include "control/tvlqr.h"
#include "core/progress.h"

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

/// The torques (N·m) that a motor has, ascending; empty: any within its limit.
using TorqueTable = std::vector<double>;

/// Finds episodes of one plant. By continuation: box-DDP on the regulator's cost from sine waves of
/// many lengths, then on the reward itself, smooth at first and sharper each time (RewardCost). For
/// a table of torques the result is rounded under feedback, and each step's torque is then changed
/// as long as that helps.
class BestEpisodeSearch {
 public:
  /// Searches from hanging with `guesses` sine waves, which `progress` counts. Throws as SolveLqr,
  /// and BadInput if none swings up.
  BestEpisodeSearch(const Plant& plant, int guesses, const Progress& progress);

  /// Of an episode, the best for either aim.
  struct Found {
    BestEpisode of_return, of_time;
  };
  /// The best that is found of an episode from `start` with each of these tables, beginning with
  /// what is best from hanging and its mirror image.
  std::vector<Found> From(const StateVector& start, std::span<const TorqueTable> tables);

  /// The torque (N·m) of the table with which the regulator holds upright.
  double Hold(const StateVector& deviation, const TorqueTable& table) const;

  const Plant& plant() const { return plant_; }

 private:
  /// A trajectory with a better return by these weights, from one that swings up.
  Trajectory Sharpen(const Trajectory& trajectory, const RewardWeights& weights);
  /// The episodes of some sequences of torques from one start.
  std::vector<BestEpisode> Judge(const StateVector& start,
                                 std::span<const std::vector<double>> torques,
                                 const TorqueTable& table, const RewardWeights& weights);
  BestEpisode Judge(const StateVector& start, const std::vector<double>& torques,
                    const TorqueTable& table = {}, const RewardWeights& weights = {}) {
    return Judge(start, {&torques, 1}, table, weights)[0];
  }
  /// The trajectory's episode with the torques of the table.
  BestEpisode WithTable(const Trajectory& trajectory, const TorqueTable& table, Aim aim);
  /// The nearest torques of the table, under feedback about the trajectory, up to the regulator's
  /// region of attraction.
  std::vector<double> Round(const Trajectory& trajectory, const TorqueTable& table);
  /// Changes one torque of the table at a time, at most a hundred times, while that makes a better
  /// episode.
  BestEpisode Polish(BestEpisode episode, const TorqueTable& table, Aim aim);
  double Nearest(double torque, const TorqueTable& table) const;

  Plant plant_;
  LqrCatch upright_;
  TrajectoryOptimizer optimizer_;
  Trajectory from_hanging_;                // with the best return
  std::vector<Eigen::RowVector4d> gains_;  // K about it: u - K (x - x_t)
};

/// Acts as an episode says, then holds upright; for one environment.
class EpisodePolicy : public PendulumController {
 public:
  /// `search` and `table` outlive it.
  EpisodePolicy(BestEpisode episode, const BestEpisodeSearch& search, const TorqueTable& table)
      : PendulumController("best-episode", Options(), search.plant()),
        episode_(std::move(episode)),
        search_(search),
        table_(table) {}

  std::string description() const override { return "the best episode that was found"; }
  std::unique_ptr<Memory> Start(int num_envs) const override {
    return std::make_unique<MemoryOf<size_t>>(num_envs, 0);
  }

 private:
  double Torque(const StateVector& deviation, size_t env, Memory& memory) const override {
    size_t& step = static_cast<MemoryOf<size_t>&>(memory).past[env];
    return step < episode_.torques.size() ? episode_.torques[step++]
                                          : search_.Hold(deviation, table_);
  }

  BestEpisode episode_;
  const BestEpisodeSearch& search_;
  const TorqueTable& table_;
};

}  // namespace upswing
