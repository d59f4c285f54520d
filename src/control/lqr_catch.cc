#include "control/lqr_catch.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "control/linearize.h"

namespace upswing {
namespace {

constexpr int kSamples = 512;  // states on an ellipsoid
constexpr int kGroup = 64;     // states simulated together
static_assert(kSamples % kGroup == 0);
constexpr double kSettled = 1e-3;  // settled: the cost has fallen to this share
constexpr double kLeastSettling = 5, kMostSettling = 40;  // s, by Scale::time
constexpr double kLargestLean = std::numbers::pi / 3;

/// Control periods in which the regulator's slowest mode makes the cost fall to kSettled, times
/// 1.5. At least kLeastSettling and at most kMostSettling.
int SettleSteps(const Lqr& lqr, const DesignPlant& plant) {
  const LinearModel model = UprightModel(plant);
  const double slowest = SpectralRadius(model.A - model.B * lqr.K);
  const double second = TaskScaleOf(plant).time / plant.control_period;  // of the built-in plant
  return static_cast<int>(std::clamp(1.5 * std::log(kSettled) / (2 * std::log(slowest)),
                                     kLeastSettling * second, kMostSettling * second));
}

/// Random points on the unit sphere in four dimensions.
std::vector<Eigen::Vector4d> Directions() {
  std::vector<Eigen::Vector4d> directions(kSamples);
  Rng rng(1, "directions");
  for (Eigen::Vector4d& d : directions) {
    for (int k = 0; k < 4; ++k) d[k] = rng.Normal();
    d.normalize();
  }
  return directions;
}

/// Whether all states x with x' P x = level, in these directions (rows of P^-1/2 d), settle.
bool AllSettle(const Lqr& lqr, double level, std::span<const Eigen::Vector4d> directions, int steps,
               PendulumModel& model) {
  std::vector<StateVector> x;
  x.reserve(directions.size());
  for (const auto& d : directions) x.push_back(FromUpright(std::sqrt(level) * d));
  std::vector<double> u(x.size());
  for (int step = 0; step < steps; ++step) {
    for (size_t i = 0; i < x.size(); ++i) {
      u[i] = lqr.Torque(UprightDeviation(x[i]), model.plant().torque_limit);
    }
    model.Step(x, u);
  }
  return std::ranges::all_of(x, [&](const StateVector& end) {
    return lqr.Cost(UprightDeviation(end)) < kSettled * level;
  });
}

}  // namespace

double RegionOfAttraction(const Lqr& lqr, const DesignPlant& plant) {
  const Eigen::Matrix4d shape =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(lqr.P).operatorInverseSqrt();
  std::vector<Eigen::Vector4d> directions = Directions();
  for (Eigen::Vector4d& d : directions) d = shape * d;

  PendulumModel model(plant);
  const int steps = SettleSteps(lqr, plant);
  // Most levels that do not settle are found by the first group.
  const auto all_settle = [&](double level) {
    for (int first = 0; first < kSamples; first += kGroup) {
      const auto group = std::span(directions).subspan(first, kGroup);
      if (!AllSettle(lqr, level, group, steps, model)) return false;
    }
    return true;
  };
  // The first level is the largest at which the torque stays within its limit: max |K x| over x' P
  // x = level is sqrt(level K P⁻¹ K'). The search changes it by factors of 2 until the result
  // changes, then bisects.
  double low = plant.torque_limit * plant.torque_limit / (lqr.K * shape).squaredNorm();
  int factors = 0;
  while (!all_settle(low)) {
    if (++factors > 40) return 0;
    low /= 2;
  }
  double high = 2 * low;
  while (factors == 0 && all_settle(high) && high < 1e6 * low) high *= 2;
  if (factors == 0) low = high / 2;
  for (int halving = 0; halving < 6; ++halving) {
    const double middle = (low + high) / 2;
    (all_settle(middle) ? low : high) = middle;
  }
  return low;
}

LqrCatch::LqrCatch(const LqrConfig& config, const DesignPlant& plant)
    : lqr_(SolveLqr(config, plant)),
      region_(RegionOfAttraction(lqr_, plant)),
      steps_(SettleSteps(lqr_, plant) / 2),
      plant_(plant) {
  if (region_ > 0) return;
  const bool dry = plant.coulomb1 > 0 || plant.coulomb2 > 0;
  throw BadInput(Concat("lqr: found no region of attraction: with these weights ",
                        dry ? "and dry friction (coulomb1, coulomb2) " : "",
                        "LQR catches the pendulum only very close to upright, if at all"));
}

bool LqrCatch::Holds(const StateVector& deviation) const {
  std::optional<PendulumModel> model;  // far from upright and in the region, none is needed
  StateVector x = FromUpright(deviation);
  for (int step = 0; step < steps_; ++step) {
    const StateVector d = UprightDeviation(x);
    const auto [lean1, lean2] = Lean(StateOf(x));
    if (std::abs(lean1) > kLargestLean || std::abs(lean2) > kLargestLean) return false;
    if (lqr_.Cost(d) <= region_) return true;
    const double u = lqr_.Torque(d, plant_.torque_limit);
    if (!model) model.emplace(plant_);
    model->Step({&x, 1}, {&u, 1});
  }
  return false;
}

}  // namespace upswing
