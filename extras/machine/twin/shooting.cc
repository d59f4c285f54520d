#include "extras/machine/twin/shooting.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace upswing::machine {
namespace {

using Eigen::Vector4d;

constexpr double kStartWeight = 0.05;  // of the prior of a start state
// Limits of the scales of the robust cost.
constexpr double kSmallestScale = 1e-5, kLargestScale = 0.1;  // rad
constexpr double kSmallestTorqueScale = 1e-3;                 // N·m, by FitParameters::scale

/// Standard deviations of a start state about its cubic (rad, rad/s).
Vector4d StartDeviation(const Scale& scale) {
  const double velocity = 0.06 * scale.velocity();
  return {0.002, 0.002, velocity, velocity};
}

double MedianError(const std::vector<WindowResiduals>& residuals,
                   SquaredResiduals WindowResiduals::*kind) {
  std::vector<double> errors;
  for (const WindowResiduals& r : residuals) errors.push_back(std::sqrt((r.*kind).mean));
  return Median(errors);
}

}  // namespace

ShootingModel::ShootingModel(std::span<const MachineLog> logs, const FitParameters& parameters,
                             const WindowRules& rules, ThreadPool* pool)
    : logs_(logs), parameters_(parameters), pool_(pool) {
  windows_ =
      CutWindows(logs, rules, parameters.FirstNumber("length1"), parameters.FirstNumber("length2"));
  for (const LogWindow& w : windows_) {
    cubics_.emplace_back(w.start.q1, w.start.q2, w.start.w1, w.start.w2);
  }
}

std::vector<int> ShootingModel::SeenSessions() const {
  std::set<int> seen;
  for (int w = 0; w < windows(); ++w) seen.insert(SessionOfWindow(w));
  return {seen.begin(), seen.end()};
}

FitPoint ShootingModel::FirstPoint() const { return {parameters_.guess(), cubics_}; }

std::vector<WindowResiduals> ShootingModel::Residuals(const FitPoint& point) const {
  return ResidualsAt(point, /*linearizes=*/false);
}

std::vector<WindowResiduals> ShootingModel::Linearize(const FitPoint& point) const {
  return ResidualsAt(point, /*linearizes=*/true);
}

std::vector<WindowResiduals> ShootingModel::ResidualsAt(const FitPoint& point,
                                                        bool linearizes) const {
  std::vector<Twin> twins;  // (sessions)
  for (int s = 0; s < parameters_.sessions().size(); ++s) {
    twins.push_back(parameters_.TwinAt(point.theta, s));
  }
  std::vector<ModelledLog> modelled;  // (logs)
  for (size_t i = 0; i < logs_.size(); ++i) {
    modelled.emplace_back(logs_[i], twins[parameters_.sessions().of_log[i]], parameters_.detail());
  }
  std::vector<WindowResiduals> residuals(windows_.size());
  ParallelFor(pool_, windows(), [&](int w) {
    residuals[w] = ResidualsOf(modelled[LogOfWindow(w)], windows_[w], point.starts[w], linearizes);
  });
  return residuals;
}

double ShootingModel::Cost(const std::vector<WindowResiduals>& residuals, const FitPoint& point,
                           const RobustScales& scales) const {
  const Vector4d deviation = StartDeviation(parameters_.scale());
  double cost = 0;
  for (int w = 0; w < windows(); ++w) {
    const auto& [angle, torque] = residuals[w];
    const double start = (point.starts[w] - cubics_[w]).cwiseQuotient(deviation).squaredNorm();
    cost += std::log1p(angle.mean / (scales.angle * scales.angle)) +
            std::log1p(torque.mean / (scales.torque * scales.torque)) + kStartWeight * start;
  }
  return cost;
}

std::vector<WindowBlock> ShootingModel::Blocks(const std::vector<WindowResiduals>& linearized,
                                               const FitPoint& point,
                                               const RobustScales& scales) const {
  const Vector4d start_prior =
      kStartWeight * StartDeviation(parameters_.scale()).cwiseAbs2().cwiseInverse();
  std::vector<WindowBlock> blocks;
  for (int w = 0; w < windows(); ++w) {
    const auto& [angle, torque] = linearized[w];
    const double angle_weight = 1 / (scales.angle * scales.angle + angle.mean);
    const double torque_weight = 1 / (scales.torque * scales.torque + torque.mean);
    const auto H = (angle_weight * angle.H + torque_weight * torque.H).eval();
    const auto g = (angle_weight * angle.g + torque_weight * torque.g).eval();
    WindowBlock& b = blocks.emplace_back();
    b.Hxx = H.topLeftCorner<4, 4>();
    b.Hxx.diagonal() += start_prior;
    const Eigen::Index constants = H.rows() - 4;
    b.Hxc = H.topRightCorner(4, constants);
    b.Hcc = H.bottomRightCorner(constants, constants);
    b.gx = g.head<4>() + start_prior.cwiseProduct(point.starts[w] - cubics_[w]);
    b.gc = g.tail(constants);
  }
  return blocks;
}

double MedianAngleError(const std::vector<WindowResiduals>& residuals) {
  return MedianError(residuals, &WindowResiduals::angle);
}

RobustScales ShootingModel::ScalesOf(const std::vector<WindowResiduals>& residuals) const {
  const double smallest_torque = kSmallestTorqueScale * parameters_.scale().torque;
  return {.angle = std::clamp(MedianAngleError(residuals), kSmallestScale, kLargestScale),
          .torque = std::max(MedianError(residuals, &WindowResiduals::torque), smallest_torque)};
}

}  // namespace upswing::machine
