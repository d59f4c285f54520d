#include "control/tvlqr.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "core/error.h"
#include "core/rng.h"
#include "core/text.h"

namespace upswing {
namespace {

constexpr int kGuesses = 8;
constexpr int kIterations = 300;
constexpr double kTolerance = 1e-7;  // of the cost, in an iteration
/// It moves to another place of the plan where that costs less than this share.
constexpr double kCheaper = 0.25;

/// A sine wave of torque: of any amplitude up to the limit, once in 1 to 2 s.
std::vector<double> Guess(Rng& rng, int steps, double limit) {
  const double amplitude = rng.Uniform(0, limit), rate = rng.Uniform(3, 6);
  const double phase = rng.Uniform(0, 2 * std::numbers::pi);
  std::vector<double> u;
  for (int t = 0; t < steps; ++t) {
    u.push_back(amplitude * std::sin(rate * kControlPeriod * t + phase));
  }
  return u;
}

/// Angles in [-π, π] of a difference of two states.
StateVector Difference(const StateVector& x, const StateVector& y) {
  return UprightDeviation(FromUpright(x - y));
}

}  // namespace

void SwingUpConfig::Describe(Options& o) {
  o.Section("tvlqr");
  o.Add(&seconds, "tvlqr_seconds", 4, {0.2, 30}, "s", "length of the planned swing-up").step =
      kControlPeriod;
  o.Add(&reserve, "tvlqr_reserve", 0.2, {0, 0.9}, "",
        "share of the motor's torque that the plan leaves to the feedback");
}

SwingUp PlanSwingUp(const LqrConfig& lqr, const SwingUpConfig& config, const LqrCatch& upright,
                    const Plant& plant) {
  const QuadraticCost cost(lqr.Q(), lqr.torque, upright.lqr().P);
  const int steps = static_cast<int>(std::lround(config.seconds / kControlPeriod));
  Plant weaker = plant;
  weaker.torque_limit *= 1 - config.reserve;
  TrajectoryOptimizer optimizer(weaker);
  Rng rng(1, "guesses");
  std::optional<Trajectory> best;
  for (int guess = 0; guess < kGuesses; ++guess) {
    Trajectory trajectory =
        optimizer.Follow(cost, StateVector::Zero(), Guess(rng, steps, weaker.torque_limit));
    optimizer.Improve(cost, kTolerance, kIterations, trajectory);
    if (!best || trajectory.cost < best->cost) best = std::move(trajectory);
  }

  PendulumModel model(plant);
  if (!upright.Holds(UprightDeviation(best->x.back()), model)) {
    throw BadInput(Concat("tvlqr: found no swing-up of ", Rounded(config.seconds), " s with ",
                          Rounded(weaker.torque_limit), " N·m that ends where lqr catches"));
  }
  return Tracking(std::move(*best), lqr, upright.lqr().P, model);
}

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
    plan.P[t] = lqr.Q() + A.transpose() * PA - PA.transpose() * B * plan.K[t];
    plan.P[t] = (plan.P[t] + plan.P[t].transpose()).eval() / 2;
  }
  return plan;
}

TvlqrPolicy::TvlqrPolicy(LqrConfig lqr, SwingUpConfig config, const Plant& plant)
    : PendulumController("tvlqr", OptionsOfAll(lqr, config), plant),
      upright_(lqr, plant),
      plan_(PlanSwingUp(lqr, config, upright_, plant)) {}

std::string TvlqrPolicy::description() const {
  return Concat("planned swing-up of ", Rounded(plan_.trajectory.steps() * kControlPeriod),
                " s, followed by a time-varying linear-quadratic regulator");
}

std::unique_ptr<Policy::Memory> TvlqrPolicy::Start(int num_envs) const {
  return std::make_unique<MemoryOf<Place>>(num_envs, Place());
}

double TvlqrPolicy::Cost(const StateVector& deviation, const Place& place) const {
  const auto t = static_cast<size_t>(place.step);
  const StateVector planned = UprightDeviation(place.sign * plan_.trajectory.x[t]);
  const StateVector d = Difference(deviation, planned);
  return d.dot(plan_.P[t] * d);
}

double TvlqrPolicy::Torque(const StateVector& deviation, size_t env, Memory& memory) const {
  Place& place = static_cast<MemoryOf<Place>&>(memory).past[env];
  const int T = plan_.trajectory.steps();
  double cost = std::numeric_limits<double>::infinity();
  if (place.step >= 0) {
    place.step = std::min(place.step + 1, T);
    cost = Cost(deviation, place);
  }
  Place nearest;
  double least = std::numeric_limits<double>::infinity();
  for (const double sign : {1.0, -1.0}) {
    for (int t = 0; t <= T; ++t) {
      const Place other{t, sign};
      const double there = Cost(deviation, other);
      if (there < least) std::tie(nearest, least) = std::tuple(other, there);
    }
  }
  if (least < kCheaper * cost) place = nearest;
  if (place.step == T) return upright_.lqr().Torque(deviation);

  const auto t = static_cast<size_t>(place.step);
  const StateVector planned = UprightDeviation(place.sign * plan_.trajectory.x[t]);
  return place.sign * plan_.trajectory.u[t] - plan_.K[t].dot(Difference(deviation, planned));
}

}  // namespace upswing
