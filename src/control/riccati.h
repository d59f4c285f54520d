#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>

/// Linear-quadratic regulators with four states and one input, by algebraic Riccati equations.
namespace upswing {

/// A linear model: ẋ = A x + B u, or x⁺ = A x + B u over one control period.
struct LinearModel {
  Eigen::Matrix4d A;
  Eigen::Vector4d B;
};

/// The regulator u = -K x and its smallest cost x' P x.
struct Lqr {
  Eigen::RowVector4d K;  // N·m/rad and N·m·s/rad
  Eigen::Matrix4d P;

  /// u (N·m) for a deviation x from upright.
  double Torque(const Eigen::Vector4d& x) const { return -K.dot(x); }
  /// u (N·m) for a deviation x from upright, within ±limit.
  double Torque(const Eigen::Vector4d& x, double limit) const {
    return std::clamp(Torque(x), -limit, limit);
  }
  /// The smallest cost from x on.
  double Cost(const Eigen::Vector4d& x) const { return x.dot(P * x); }
};

/// Minimises Σ x' Q x + R u² of x⁺ = A x + B u, with Q ≥ 0 and symmetric, R > 0:
///   P = Q + A' P A - A' P B (R + B' P B)⁻¹ B' P A
/// Method: structure-preserving doubling of Chu, Fan, Lin, Wang, "Structure-preserving algorithms
/// for periodic discrete-time algebraic Riccati equations", International Journal of Control 77
/// (2004), algorithm 2.1. Returns nothing if there is no solution: (A, B) cannot be stabilised, or
/// Q gives no cost to a mode that has to be stabilised.
std::optional<Lqr> SolveDiscreteLqr(const LinearModel& model, const Eigen::Matrix4d& Q, double R);

/// Largest |eigenvalue| of a finite square matrix: x⁺ = A x decays if it is below 1. The size is
/// dynamic, because a fixed size takes twice as long to compile.
double SpectralRadius(const Eigen::MatrixXd& A);

}  // namespace upswing
