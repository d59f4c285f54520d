#pragma once

#include <array>

#include "pendulum/plant.h"

/// The equations of motion of every plant (Murray, Li and Sastry, "A Mathematical Introduction to
/// Robotic Manipulation", 1994, Section 4.2). MuJoCo or closed_form.cc solves them in a training.
/// dynamics.inc has them as code.
///   M(q) q̈ + c(q, q̇) + g(q) + d q̇ + f atan(100 q̇) = τ
///   M = [[J1 + J2 + 2 b cos q2, J2 + b cos q2], [·, J2 + a]]
/// Symbols: q = (q1, q2) joint angles (rad; 0 hanging, q2 relative to link 1), q̇ = (w1, w2)
/// velocities (rad/s), τ torques at both joints (N·m), c velocity terms, g gravity, d damping.
/// Dry friction f is smoothed as in RealAIGym's plant (Wiebe et al., "Open source dual-purpose
/// acrobot and pendubot platform", IEEE Robotics and Automation Magazine 31 (2024)).
namespace upswing {

template <typename T>
struct MassMatrixOf {
  T M11, M12, M22;  // kg·m²
  T det;            // kg²·m⁴
};
using MassMatrix = MassMatrixOf<double>;

/// The terms of the equations of motion in one state.
struct ManipulatorTerms : MassMatrix {
  double h1, h2;  // N·m: velocity, gravity, damping and dry friction; M q̈ + h = τ
  double energy;  // kinetic and potential, J; 0 at rest upright
};

/// The constants of the equations of motion, as numbers of type T. Motor rotors change only J1, J2
/// and a.
template <typename T>
struct ManipulatorConstants {
  T J1;      // inertia about joint 1 with link 2 as a point at joint 2, plus armature, kg·m²
  T J2;      // inertia of link 2 about joint 2, kg·m²
  T b;       // mass of link 2 · length of link 1 · centre of link 2: coupling, kg·m²
  T a;       // armature of joint 2, kg·m²
  T G1;      // largest moment of gravity about joint 1, link 2 as a point at joint 2, N·m
  T G2;      // largest moment of gravity on link 2 about joint 2, N·m
  T d1, d2;  // damping, N·m·s/rad
  T f1, f2;  // dry friction f, N·m; its torque is at most π/2 f
};

/// The equations of motion of a plant.
struct Manipulator : ManipulatorConstants<double> {
  /// Adds the rotors of two motors (kg·m² each) behind gears (rotors.cc). Rotor 1 turns at
  /// gear · w1. Link 1 carries rotor 2, which turns at w1 - gear · w2.
  void AddRotors(double inertia, double gear);

  MassMatrix Mass(double cos_q2) const;
  ManipulatorTerms At(const PendulumState& s) const;
  /// q̈ (rad/s²) under the torques (N·m) at both joints.
  std::array<double, 2> Acceleration(const PendulumState& s,
                                     const std::array<double, 2>& torque) const;
};

Manipulator ManipulatorOf(const Plant& plant);

}  // namespace upswing
