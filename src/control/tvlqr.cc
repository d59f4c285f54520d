#include "control/tvlqr.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"

namespace upswing {
namespace {

constexpr int kGuesses = 16;
/// Longest guess, s, by Scale::time. At first, longer plans hold upright to their end.
constexpr double kLongestGuess = 5;
constexpr int kPlanIterations = 300;
constexpr double kPlanTolerance = 1e-7;  // relative gain of an iteration
/// The policy moves to another place of the plan if that costs less than this share.
constexpr double kCheaper = 0.25;

/// A swing-up from hanging of `steps` control periods, found by trajectory optimisation from a
/// random guess. The guess is a sine wave of torque with a period of 1 to 2 s for the built-in
/// plant; amplitude, length and the price of the way against its end are random. The regulator
/// holds from the wave's end to the plan's end. Returns nothing if the result does not end where
/// `upright` catches.
std::optional<Trajectory> GuessSwingUp(const LqrConfig& lqr, const LqrCatch& upright, int steps,
                                       Rng& rng, TrajectoryOptimizer& optimizer) {
  const DesignPlant& plant = optimizer.model().plant();
  const Scale& scale = optimizer.model().scale();
  const double limit = plant.torque_limit, period = plant.control_period;
  const auto longest = static_cast<int>(std::lround(kLongestGuess * scale.time / period));
  const auto length = static_cast<size_t>(rng.Uniform(0.4, 1) * std::min(steps, longest));
  const double amplitude = rng.Uniform(0, limit), rate = rng.Uniform(3, 6) * scale.velocity();
  const double phase = rng.Uniform(0, 2 * std::numbers::pi);
  const double price = std::pow(10, rng.Uniform(-2.5, 0));
  std::vector<double> torques;
  for (size_t t = 0; t < length; ++t) {
    torques.push_back(amplitude * std::sin(rate * period * static_cast<double>(t) + phase));
  }
  const QuadraticCost cost(price * WeightsOf(lqr), price * lqr.torque, upright.lqr().P);
  Trajectory trajectory = optimizer.Follow(cost, StateVector::Zero(), torques);
  optimizer.Improve(cost, kPlanTolerance, kPlanIterations, trajectory);
  if (!upright.Holds(UprightDeviation(trajectory.x.back()))) return {};
  while (trajectory.steps() < steps) {
    StateVector x = trajectory.x.back();
    const double u = upright.lqr().Torque(UprightDeviation(x), limit);
    optimizer.model().Step({&x, 1}, {&u, 1});
    trajectory.x.push_back(x);
    trajectory.u.push_back(u);
  }
  return trajectory;
}

/// The time-varying linear-quadratic regulator about a trajectory, with the final cost x' P x:
/// Tedrake, "Underactuated Robotics", chapter 8. `model` is a model of the same plant.
SwingUp Tracking(Trajectory trajectory, const LqrConfig& lqr, const Eigen::Matrix4d& P,
                 PendulumModel& model) {
  const size_t T = trajectory.u.size();
  std::vector<LinearModel> models(T);
  model.Linearize({trajectory.x.data(), T}, trajectory.u, models);
  SwingUp plan{std::move(trajectory), std::vector<Eigen::RowVector4d>(T),
               std::vector<Eigen::Matrix4d>(T + 1)};
  plan.P[T] = P;
  for (size_t t = T; t-- > 0;) {
    const auto& [A, B] = models[t];
    const Eigen::Matrix4d PA = plan.P[t + 1] * A;
    plan.K[t] = B.transpose() * PA / (lqr.torque + B.dot(plan.P[t + 1] * B));
    plan.P[t] = WeightsOf(lqr) + A.transpose() * PA - PA.transpose() * B * plan.K[t];
    plan.P[t] = (plan.P[t] + plan.P[t].transpose()).eval() / 2;
  }
  return plan;
}

}  // namespace

SwingUp PlanSwingUp(const LqrConfig& lqr, const SwingUpConfig& config, const LqrCatch& upright,
                    const DesignPlant& plant) {
  const QuadraticCost cost(WeightsOf(lqr), lqr.torque, upright.lqr().P);
  const int steps = static_cast<int>(std::lround(config.seconds / plant.control_period));
  DesignPlant weaker = plant;
  weaker.torque_limit *= 1 - config.reserve;
  TrajectoryOptimizer optimizer(weaker);
  PendulumModel model(plant);
  Rng rng(1, "guesses");
  std::optional<Trajectory> best;
  for (int guess = 0; guess < kGuesses; ++guess) {
    std::optional<Trajectory> found = GuessSwingUp(lqr, upright, steps, rng, optimizer);
    if (!found) continue;
    Trajectory trajectory = TrajectoryOptimizer::Priced(cost, *std::move(found));
    optimizer.Improve(cost, kPlanTolerance, kPlanIterations, trajectory);
    const bool holds = upright.Holds(UprightDeviation(trajectory.x.back()));
    if (holds && (!best || trajectory.cost < best->cost)) best = std::move(trajectory);
  }
  if (!best) {
    throw BadInput(Concat("tvlqr: found no swing-up of ", Rounded(config.seconds), " s with ",
                          Rounded(weaker.torque_limit),
                          " N·m that ends where lqr catches; try a larger --tvlqr-seconds or "
                          "--tvlqr-reserve 0, which gives the plan the whole torque limit"));
  }
  return Tracking(*std::move(best), lqr, upright.lqr().P, model);
}

TvlqrPolicy::TvlqrPolicy(LqrConfig lqr, SwingUpConfig config, const DesignPlant& plant)
    : PendulumController("tvlqr", OptionsOfAll(lqr, config), plant),
      upright_(lqr, plant),
      plan_(PlanSwingUp(lqr, config, upright_, plant)) {}

std::string TvlqrPolicy::description() const {
  return Concat("planned swing-up of ", Rounded(plan_.trajectory.steps() * plant().control_period),
                " s, followed by a time-varying linear-quadratic regulator");
}

std::unique_ptr<Policy::Memory> TvlqrPolicy::Start(int num_envs) const {
  auto places = std::make_unique<Places>();
  places->of_env.resize(static_cast<size_t>(num_envs));
  return places;
}

StateVector TvlqrPolicy::OffPlan(const StateVector& deviation, const Place& place) const {
  const auto t = static_cast<size_t>(place.step);
  return Difference(deviation, UprightDeviation(place.sign * plan_.trajectory.x[t]));
}

double TvlqrPolicy::Torque(const StateVector& deviation, size_t env, Memory& memory) const {
  Place& place = static_cast<Places&>(memory).of_env[env];
  const int T = plan_.trajectory.steps();
  if (upright_.Holds(deviation)) {
    place = {T, 1};
    return upright_.lqr().Torque(deviation);
  }
  const auto cost = [&](const Place& there) {
    const StateVector d = OffPlan(deviation, there);
    return d.dot(plan_.P[static_cast<size_t>(there.step)] * d);
  };
  double now = std::numeric_limits<double>::infinity();
  if (place.step >= 0) {
    ++place.step;
    if (place.step < T) now = cost(place);
  }
  Place nearest;
  double least = std::numeric_limits<double>::infinity();
  for (const double sign : {1.0, -1.0}) {
    for (int t = 0; t < T; ++t) {
      const double there = cost({t, sign});
      if (there < least) {
        nearest = {t, sign};
        least = there;
      }
    }
  }
  if (least < kCheaper * now) place = nearest;
  const auto t = static_cast<size_t>(place.step);
  return place.sign * plan_.trajectory.u[t] - plan_.K[t].dot(OffPlan(deviation, place));
}

}  // namespace upswing
