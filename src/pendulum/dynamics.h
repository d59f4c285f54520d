#pragma once

#include <cmath>
#include <type_traits>

#include "pendulum/equations.h"

/// The equations of motion for doubles, and for dual numbers such as Eigen::AutoDiffScalar.
namespace upswing::dynamics {

template <typename T>
T Number(double x) {
  return T(x);
}
template <typename X, typename T>
T MulAdd(const X& x, const T& y, const std::type_identity_t<T>& z) {
  return x * y + z;
}
template <typename X, typename T>
T MulSub(const X& x, const T& y, const std::type_identity_t<T>& z) {
  return x * y - z;
}
template <typename X, typename T>
T NegMulAdd(const X& x, const T& y, const std::type_identity_t<T>& z) {
  return z - x * y;
}
template <typename T>
T Atan(const T& x) {
  return atan2(x, T(1));  // AutoDiffScalar lacks atan
}
inline double Atan(double x) { return std::atan(x); }

#include "pendulum/dynamics.inc"

template <typename T>
JointAngles<T> AnglesOf(const JointPair<T>& q) {
  using std::cos, std::sin;
  return {sin(q.one), cos(q.one), sin(q.two), cos(q.two)};
}

}  // namespace upswing::dynamics
