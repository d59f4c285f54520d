#include "control/lqr_catch.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/rng.h"

namespace upswing {
namespace {

constexpr int kSamples = 512;      // states of an ellipsoid
constexpr int kSettleSteps = 250;  // control periods after which they have to be caught: 5 s
constexpr double kSettled = 1e-3;  // by which share their cost has to have fallen then
constexpr int kCatchSteps = 100;   // control periods of Holds: 2 s
constexpr double kLargestLean = std::numbers::pi / 3;

/// Points of the unit sphere in four dimensions.
std::vector<Eigen::Vector4d> Directions() {
  std::vector<Eigen::Vector4d> directions(kSamples);
  Rng rng(1, "directions");
  for (Eigen::Vector4d& d : directions) {
    for (int k = 0; k < 4; ++k) d[k] = rng.Normal();
    d.normalize();
  }
  return directions;
}

/// The limited torques of the regulator at these states.
void Torques(const Lqr& lqr, double limit, const std::vector<StateVector>& x,
             std::vector<double>& u) {
  for (size_t i = 0; i < x.size(); ++i) {
    u[i] = std::clamp(lqr.Torque(UprightDeviation(x[i])), -limit, limit);
  }
}

/// Whether all states x with x' P x = level, in these directions (rows of P^-1/2 d), settle.
bool AllSettle(const Lqr& lqr, double level, const std::vector<Eigen::Vector4d>& directions,
               PendulumModel& model) {
  std::vector<StateVector> x;
  for (const auto& d : directions) x.push_back(FromUpright(std::sqrt(level) * d));
  std::vector<double> u(x.size());
  for (int step = 0; step < kSettleSteps; ++step) {
    Torques(lqr, model.plant().torque_limit, x, u);
    model.Step(x, u);
  }
  return std::ranges::all_of(x, [&](const StateVector& end) {
    return lqr.Cost(UprightDeviation(end)) < kSettled * level;
  });
}

}  // namespace

double RegionOfAttraction(const Lqr& lqr, const Plant& plant) {
  const Eigen::Matrix4d shape =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(lqr.P).operatorInverseSqrt();
  std::vector<Eigen::Vector4d> directions = Directions();
  for (Eigen::Vector4d& d : directions) d = shape * d;

  // Inside this level the torque is within its limit: max |K x| over x' P x = level is
  // sqrt(level K P⁻¹ K').
  PendulumModel model(plant);
  const double linear = plant.torque_limit * plant.torque_limit /
                        (lqr.K * lqr.P.inverse() * lqr.K.transpose()).value();
  double low = 0, high = linear;
  while (AllSettle(lqr, high, directions, model) && high < 1e6 * linear) {
    low = high;
    high *= 2;
  }
  for (int halving = 0; halving < 8; ++halving) {
    const double middle = (low + high) / 2;
    (AllSettle(lqr, middle, directions, model) ? low : high) = middle;
  }
  return low;
}

LqrCatch::LqrCatch(const LqrConfig& config, const Plant& plant)
    : lqr_(SolveLqr(config, plant)),
      region_(RegionOfAttraction(lqr_, plant)),
      limit_(plant.torque_limit) {}

bool LqrCatch::Holds(const StateVector& deviation, PendulumModel& model) const {
  StateVector x = FromUpright(deviation);
  for (int step = 0; step < kCatchSteps; ++step) {
    const StateVector d = UprightDeviation(x);
    const double lean2 = UprightDeviation({x[0] + x[1], 0, 0, 0})[0];
    if (std::abs(d[0]) > kLargestLean || std::abs(lean2) > kLargestLean) return false;
    if (lqr_.Cost(d) <= region_) return true;
    const double u = std::clamp(lqr_.Torque(d), -limit_, limit_);
    model.Step({&x, 1}, {&u, 1});
  }
  return false;
}

}  // namespace upswing
