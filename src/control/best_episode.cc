#include "control/best_episode.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>

#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "control/reward_cost.h"

namespace upswing {
namespace {

constexpr int kReturnSteps = 500;
static_assert(kReturnSteps * kControlPeriod == kReturnSeconds);
/// Number of optimised steps: 6 s; upright is reached in less than half of them.
constexpr int kPlannedSteps = 300;
/// Smoothing widths of the reward, in the order of use.
constexpr double kWidths[] = {0.3, 0.1, 0.05, 0.02, 0.01};
constexpr double kSearchTolerance = 1e-6;
constexpr int kSearchIterations = 150;
constexpr int kChanges = 100;  // largest number of changes of single torques

/// Reward weights with which the return grows with the time upright. Small energy and height terms
/// guide the search.
RewardConfig WeightsOf(Aim aim) {
  RewardConfig weights;
  if (aim == Aim::kTime) weights.weight = {0.02, 0.02, 1, 0, 0};
  return weights;
}

/// Whether one episode is better than another.
bool IsBetter(const BestEpisode& one, const BestEpisode& other, Aim aim) {
  const auto score = [&](const BestEpisode& e) {
    return aim == Aim::kTime ? std::pair(-e.swing_up_seconds, e.reward_sum)
                             : std::pair(e.reward_sum, 0.0);
  };
  return score(one) > score(other);
}

}  // namespace

BestEpisodeSearch::BestEpisodeSearch(const Plant& plant, int guesses, const Progress& progress)
    : plant_(plant), upright_(LqrConfig(), plant), optimizer_(plant) {
  const LqrConfig lqr;
  Rng rng(1, "guesses");
  std::optional<Trajectory> best;
  double most = 0;
  for (int guess = 0; guess < guesses; ++guess) {
    if (const auto found = GuessSwingUp(lqr, upright_, kPlannedSteps, rng, optimizer_)) {
      Trajectory trajectory = Sharpen(*found, WeightsOf(Aim::kReturn));
      const double reward_sum = Judge(StateVector::Zero(), trajectory.u).reward_sum;
      if (!best || reward_sum > most) {
        most = reward_sum;
        best = std::move(trajectory);
      }
    }
    if (progress) progress(guess + 1, guesses);
  }
  if (!best) {
    throw BadInput(Concat("--guesses: found no swing-up of this plant with ",
                          Rounded(plant.torque_limit), " N·m from ", guesses, " guesses"));
  }
  from_hanging_ = *std::move(best);
  gains_ = Tracking(from_hanging_, lqr, upright_.lqr().P, optimizer_.model()).K;
}

double BestEpisodeSearch::Nearest(double torque, const TorqueTable& table) const {
  if (table.empty()) return std::clamp(torque, -plant_.torque_limit, plant_.torque_limit);
  return *std::ranges::min_element(table, {}, [&](double u) { return std::abs(u - torque); });
}

double BestEpisodeSearch::Hold(const StateVector& deviation, const TorqueTable& table) const {
  return Nearest(upright_.lqr().Torque(deviation), table);
}

Trajectory BestEpisodeSearch::Sharpen(const Trajectory& trajectory, const RewardConfig& weights) {
  Trajectory now = trajectory, best = trajectory;
  double most = Judge(trajectory.x[0], trajectory.u, {}, weights).reward_sum;
  for (const double width : kWidths) {
    const RewardCost cost(plant_, weights, width);
    now = TrajectoryOptimizer::Priced(cost, std::move(now));
    optimizer_.Improve(cost, kSearchTolerance, kSearchIterations, now);
    const double reward_sum = Judge(now.x[0], now.u, {}, weights).reward_sum;
    if (reward_sum > most) std::tie(most, best) = std::tuple(reward_sum, now);
  }
  return best;
}

std::vector<BestEpisode> BestEpisodeSearch::Judge(const StateVector& start,
                                                  std::span<const std::vector<double>> torques,
                                                  const TorqueTable& table,
                                                  const RewardConfig& weights) {
  std::vector<BestEpisode> episodes;
  for (const auto& sequence : torques) episodes.push_back({start, sequence});
  std::vector<StateVector> x(torques.size(), start);
  std::vector<double> u(torques.size());
  for (size_t t = 0; t < kReturnSteps; ++t) {
    for (size_t i = 0; i < x.size(); ++i) {
      u[i] = t < torques[i].size() ? torques[i][t] : Hold(UprightDeviation(x[i]), table);
    }
    optimizer_.model().Step(x, u);
    for (size_t i = 0; i < x.size(); ++i) {
      const PendulumState s = StateOf(x[i]);
      const auto terms = RewardTerms(plant_, s, u[i]);
      for (size_t k = 0; k < terms.size(); ++k) {
        episodes[i].reward_sum += weights.weight[k] * terms[k];
      }
      if (!Inverted(s)) episodes[i].swing_up_seconds = static_cast<double>(t + 2) * kControlPeriod;
    }
  }
  return episodes;
}

std::vector<double> BestEpisodeSearch::Round(const Trajectory& trajectory,
                                             const TorqueTable& table) {
  const LqrConfig lqr;
  const std::vector<Eigen::RowVector4d> K =
      Tracking(trajectory, lqr, upright_.lqr().P, optimizer_.model()).K;
  std::vector<double> torques;
  StateVector x = trajectory.x[0];
  for (size_t t = 0; t < K.size(); ++t) {
    const StateVector deviation = UprightDeviation(x);
    if (upright_.lqr().Cost(deviation) < upright_.region()) break;
    torques.push_back(Nearest(trajectory.u[t] - K[t].dot(x - trajectory.x[t]), table));
    optimizer_.model().Step({&x, 1}, {&torques.back(), 1});
  }
  return torques;
}

BestEpisode BestEpisodeSearch::Polish(BestEpisode episode, const TorqueTable& table, Aim aim) {
  for (int change = 0; change < kChanges; ++change) {
    std::vector<std::vector<double>> changed;
    for (size_t t = 0; t < episode.torques.size(); ++t) {
      for (const double level : table) {
        if (level == episode.torques[t]) continue;
        changed.push_back(episode.torques);
        changed.back()[t] = level;
      }
    }
    bool better = false;
    for (BestEpisode& other : Judge(episode.start, changed, table, RewardConfig())) {
      if (!IsBetter(other, episode, aim)) continue;
      episode = std::move(other);
      better = true;
    }
    if (!better) break;
  }
  return episode;
}

BestEpisode BestEpisodeSearch::WithTable(const Trajectory& trajectory, const TorqueTable& table,
                                         Aim aim) {
  const StateVector& start = trajectory.x[0];
  if (table.empty()) return Judge(start, trajectory.u);
  return Polish(Judge(start, Round(trajectory, table), table), table, aim);
}

std::vector<BestEpisodeSearch::Found> BestEpisodeSearch::From(const StateVector& start,
                                                              std::span<const TorqueTable> tables) {
  // First guesses: the known torques and their mirror image, under feedback from this start.
  const LqrConfig lqr;
  const QuadraticCost cost(WeightsOf(lqr), lqr.torque, upright_.lqr().P);
  std::vector<Eigen::RowVector4d> feedback;
  for (const Eigen::RowVector4d& K : gains_) feedback.emplace_back(-K);
  std::vector<Found> best(tables.size());
  for (const double sign : {1.0, -1.0}) {
    Trajectory planned = from_hanging_;
    for (StateVector& x : planned.x) x *= sign;
    for (double& u : planned.u) u *= sign;
    Trajectory trajectory = optimizer_.Follow(cost, start, planned, feedback);
    optimizer_.Improve(cost, kSearchTolerance, kSearchIterations, trajectory);
    for (const Aim aim : {Aim::kReturn, Aim::kTime}) {
      trajectory = Sharpen(trajectory, WeightsOf(aim));
      for (size_t i = 0; i < tables.size(); ++i) {
        BestEpisode& most = aim == Aim::kReturn ? best[i].of_return : best[i].of_time;
        BestEpisode episode = WithTable(trajectory, tables[i], aim);
        if (sign == 1 || IsBetter(episode, most, aim)) most = std::move(episode);
      }
    }
  }
  return best;
}

}  // namespace upswing
