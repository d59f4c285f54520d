#pragma once

#include <span>
#include <vector>

#include "base/progress.h"
#include "control/lqr_catch.h"
#include "control/trajectory.h"
#include "control/tvlqr.h"

/// Search for the best return and the shortest swing-up of an episode, with full knowledge of the
/// plant and the start state. A better episode may exist: the results are a lower bound on the best
/// return and an upper bound on the shortest time.
namespace upswing {

/// Torques of an episode from its start. After the last one, upright is near and the regulator
/// holds.
struct BestEpisode {
  StateVector start;
  std::vector<double> torques;  // N·m, one for each control period
  double reward_sum = 0;        // return, over the first kReturnSeconds
  double swing_up_seconds = 0;  // start of the final inverted stretch of the first kReturnSeconds
};

/// The objective of a search: the largest return or the shortest swing-up time.
enum class Aim { kReturn, kTime };

/// The torques (N·m) that a motor can apply, ascending; empty: any torque within its limit.
using TorqueTable = std::vector<double>;

/// Finds episodes of one plant by continuation. First, box-DDP minimises the regulator's cost from
/// sine waves of many lengths. Then it maximises the reward itself, smooth at first and sharper in
/// each round (RewardCost). For a torque table, feedback rounds the result, and single torques are
/// changed as long as that helps.
class BestEpisodeSearch {
 public:
  /// Searches from hanging with `guesses` sine waves; `progress` counts them. Throws as SolveLqr
  /// does, and BadInput if no guess swings up.
  BestEpisodeSearch(const Plant& plant, int guesses, const Progress& progress);

  /// The best episode found for each aim.
  struct Found {
    BestEpisode of_return, of_time;
  };
  /// The best episodes found from `start`, one Found for each table. The search begins with the
  /// best trajectory from hanging and its mirror image.
  std::vector<Found> From(const StateVector& start, std::span<const TorqueTable> tables);

  /// The torque (N·m) of the table that is nearest to the regulator's torque.
  double Hold(const StateVector& deviation, const TorqueTable& table) const;

  const Plant& plant() const { return plant_; }

 private:
  /// Improves the return, by these weights, of a trajectory that swings up.
  Trajectory Sharpen(const Trajectory& trajectory, const RewardConfig& weights);
  /// Simulates one episode for each sequence of torques, all from one start.
  std::vector<BestEpisode> Judge(const StateVector& start,
                                 std::span<const std::vector<double>> torques,
                                 const TorqueTable& table, const RewardConfig& weights);
  BestEpisode Judge(const StateVector& start, const std::vector<double>& torques,
                    const TorqueTable& table = {}, const RewardConfig& weights = {}) {
    return Judge(start, {&torques, 1}, table, weights)[0];
  }
  /// The trajectory's episode, rounded to the torques of the table.
  BestEpisode WithTable(const Trajectory& trajectory, const TorqueTable& table, Aim aim);
  /// The table's torques nearest to the feedback about the trajectory, until the state is in the
  /// regulator's region of attraction.
  std::vector<double> Round(const Trajectory& trajectory, const TorqueTable& table);
  /// Changes one torque of the table at a time while that improves the episode, at most kChanges
  /// times.
  BestEpisode Polish(BestEpisode episode, const TorqueTable& table, Aim aim);
  double Nearest(double torque, const TorqueTable& table) const;

  Plant plant_;
  LqrCatch upright_;
  TrajectoryOptimizer optimizer_;
  Trajectory from_hanging_;                // trajectory with the best return
  std::vector<Eigen::RowVector4d> gains_;  // feedback K about it: u - K (x - x_t)
};

/// Replays an episode's torques, then holds upright; for one environment.
class EpisodePolicy : public PendulumController {
 public:
  /// `search` and `table` must outlive the policy.
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
