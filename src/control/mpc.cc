#include "control/mpc.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/text.h"

namespace upswing {
namespace {

constexpr double kTolerance = 1e-6;  // relative gain of an iteration

}  // namespace

/// The plans of some environments, and one optimiser for all of them.
struct MpcPolicy::Plans : Memory {
  Plans(int num_envs, const DesignPlant& plant, int planning_steps)
      : plans(static_cast<size_t>(num_envs)), optimizer(plant, planning_steps) {}

  struct Plan {
    Trajectory trajectory;
    std::vector<Eigen::RowVector4d> K;  // (T)
  };
  std::vector<Plan> plans;  // (N)
  TrajectoryOptimizer optimizer;
};

MpcPolicy::MpcPolicy(LqrConfig lqr, MpcConfig config, const DesignPlant& plant)
    : PendulumController("mpc", OptionsOfAll(lqr, config), plant),
      config_(config),
      planning_steps_(PlanningSteps(plant)),
      lqr_(SolveLqr(lqr, plant)),
      cost_(WeightsOf(lqr), lqr.torque, lqr_.P, config.angle_range) {}

std::string MpcPolicy::description() const {
  return Concat("model predictive control, ", Rounded(config_.seconds), " s ahead, ",
                config_.iterations, " iterations a decision");
}

std::unique_ptr<Policy::Memory> MpcPolicy::Start(int num_envs) const {
  return std::make_unique<Plans>(num_envs, plant(), planning_steps_);
}

std::unique_ptr<Policy::Memory> MpcPolicy::StartFrom(
    const Trajectory& plan, const std::vector<Eigen::RowVector4d>& K) const {
  auto plans = std::make_unique<Plans>(1, plant(), planning_steps_);
  plans->plans[0] = {plan, K};
  return plans;
}

Trajectory MpcPolicy::FirstPlan(TrajectoryOptimizer& optimizer, const StateVector& x,
                                size_t T) const {
  const auto guesses = static_cast<int>(config_.guesses);
  Trajectory best;
  for (int i = 0; i < guesses; ++i) {
    const double share = guesses == 1 ? 0 : 2.0 * i / (guesses - 1) - 1;
    const std::vector<double> torques(T, share * plant().torque_limit);
    Trajectory plan = optimizer.Follow(cost_, x, torques);
    if (guesses > 1) optimizer.Improve(cost_, kTolerance, kFirstIterations, plan);
    if (i == 0 || plan.cost < best.cost) best = std::move(plan);
  }
  return best;
}

double MpcPolicy::Torque(const StateVector& deviation, size_t env, Memory& memory) const {
  auto& plans = static_cast<Plans&>(memory);
  auto& [trajectory, K] = plans.plans[env];
  TrajectoryOptimizer& optimizer = plans.optimizer;
  const auto T = static_cast<size_t>(std::lround(config_.seconds / plant().control_period));
  StateVector x = FromUpright(deviation);
  const bool first = trajectory.u.empty();
  if (first) {
    // A range counts turns from hanging at 0. Without one, 0 and 2π are alike.
    if (config_.angle_range < MpcConfig().angle_range) x[0] = Wrapped(x[0]);
    trajectory = FirstPlan(optimizer, x, T);
  } else {
    // Shift the plan by one step; the regulator chooses the new last torque.
    const StateVector last = UprightDeviation(trajectory.x.back());
    trajectory.x.erase(trajectory.x.begin());
    trajectory.u.erase(trajectory.u.begin());
    K.erase(K.begin());
    trajectory.u.push_back(lqr_.Torque(last));
    K.emplace_back(-lqr_.K);
    // Count full turns as the plan does.
    x = trajectory.x[0] + Difference(x, trajectory.x[0]);
  }
  // Take the regulator's own trajectory if it costs less. It holds the nearest upright, also one
  // that is no goal; then its cost is large.
  const Trajectory upright{std::vector<StateVector>(T + 1, x - UprightDeviation(x)),
                           std::vector<double>(T, 0.0), 0};
  const std::vector<Eigen::RowVector4d> regulator(T, -lqr_.K);
  std::vector<TrajectoryOptimizer::FeedbackPlan> candidates{{upright, regulator}};
  if (!first) candidates.push_back({trajectory, K});
  std::vector<Trajectory> followed = optimizer.Follow(cost_, x, candidates);
  Trajectory& regulated = followed.front();
  if (!first) trajectory = std::move(followed.back());
  if (regulated.cost < trajectory.cost) trajectory = std::move(regulated);
  if (first) {
    optimizer.Improve(cost_, kTolerance, kFirstIterations, trajectory);
  } else {
    optimizer.Improve(cost_, 0, static_cast<int>(config_.iterations), trajectory);
  }
  K = optimizer.gains();
  // A fall may be faster than a few iterations can plan. The share of a torque that accelerates the
  // motor's joint: 1 up to 2/3 of the velocity, 0 at the velocity, -1 from 4/3 on.
  const double w = x[plant().actuated_joint == 1 ? 2 : 3];
  const double u = trajectory.u[0];
  return u * w > 0 ? u * std::clamp(3 * (1 - std::abs(w) / config_.velocity), -1.0, 1.0) : u;
}

}  // namespace upswing
