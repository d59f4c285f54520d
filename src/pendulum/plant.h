#pragma once

#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/options.h"

/// The double pendulum: its parameters, its links as rigid bodies, and its state.
namespace upswing {

/// Time between two actions by default (s), in which the physics of the built-in plant makes
/// kPhysicsSteps steps.
inline constexpr double kControlPeriod = 0.02;
inline constexpr double kPhysicsTimestep = 0.005;  // s
inline constexpr int kPhysicsSteps = 4;
static_assert(kPhysicsSteps * kPhysicsTimestep == kControlPeriod);
inline constexpr double kShortestPeriod = 0.001, kLongestPeriod = 1;  // between actions, s

/// Constants of every plant; Mjcf uses the same values.
inline constexpr double kArmature = 0.01;       // of both joints, kg·m²
inline constexpr double kCapsuleRadius = 0.04;  // of links of 0.1 m and longer, m
inline constexpr double kFrictionSlope = 100;   // of the dry friction's arctangent, s/rad

/// The parameters that can be set at run time. By default the links are solid capsules of
/// CapsuleRadius, whose inertia and centre of mass follow from mass and length.
struct Plant {
  double mass1 = 1.0, mass2 = 1.0;        // kg
  double length1 = 0.5, length2 = 0.5;    // m
  double damping1 = 0.2, damping2 = 0.2;  // N·m·s/rad
  double gravity = 9.81;                  // m/s², along -z
  double torque_limit = 5.0;              // N·m
  double actuated_joint = 1;              // the motor's joint: 1 (a pendubot) or 2 (an acrobot)
  double rotor_inertia = 0;               // of the motor at each joint, kg·m²
  double gear_ratio = 6;                  // turns of the rotor for one turn of its joint
  double coulomb1 = 0, coulomb2 = 0;      // dry friction c of each joint, in c atan(100 w), N·m
  double center1 = 0, center2 = 0;        // joint to centre of mass, m; 0: the capsule's middle
  double inertia1 = 0, inertia2 = 0;      // about the centre of mass, kg·m²; 0: the capsule's
  double armature = kArmature;            // of both joints, kg·m²
  double armature1 = -1;                  // of joint 1, kg·m²; below 0: armature

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);

  bool has_dry_friction() const { return coulomb1 != 0 || coulomb2 != 0; }
  /// Armature of joint 1 without rotors, kg·m².
  double own_armature1() const { return armature1 < 0 ? armature : armature1; }
  /// Whether a link has its own centre of mass or inertia, instead of a capsule's.
  bool has_own_links() const {
    return center1 != 0 || center2 != 0 || inertia1 != 0 || inertia2 != 0;
  }
};

/// A parameter of the plant as a setting.
struct PlantParameter {
  const char* name;
  double Plant::*value;
  Range range;
  const char *unit, *help;
};
/// All parameters. Files of every version have the first kMainParameters.
extern const std::array<PlantParameter, 19> kPlantParameters;
inline constexpr size_t kMainParameters = 8;

/// Name and value of each parameter of the plant, as files have them. Only the first
/// kMainParameters also stand there at their defaults.
std::vector<std::pair<std::string, double>> PlantValues(const Plant& plant);

/// Principal moments of inertia (kg·m²) of a solid capsule, across and along its axis: mass m (kg),
/// radius r (m), length l of its cylinder (m).
struct CapsuleInertia {
  double across, along;

  CapsuleInertia(double m, double r, double l);
};

/// Radius (m) of the capsule of a link of this length (m): kCapsuleRadius, or 8% of a length below
/// 0.1 m, as the built-in plant has.
double CapsuleRadius(double length);

/// A link as a rigid body: mass m (kg), length l (m), distance c of the centre of mass from the
/// link's joint (m), moment of inertia I about the centre of mass and the hinge's axis (kg·m²).
struct Link {
  double m, l, c, I;
};

/// The links that move: solid capsules, or with the plant's own centres of mass and inertias.
std::array<Link, 2> LinksOf(const Plant& plant);

/// Armature of joint 1, with the rotor of its motor, kg·m².
double Armature1(const Plant& plant);

/// Torque (N·m) of the dry friction f (N·m) against a velocity w (rad/s): f atan(100 w).
inline double DryFriction(double f, double w) { return f * std::atan(kFrictionSlope * w); }

/// State of the two joints.
struct PendulumState {
  double q1 = 0, q2 = 0;  // rad
  double w1 = 0, w2 = 0;  // rad/s
};

/// The state at the fraction `share` of the `h` seconds between states a and b. The path is the
/// cubic that matches the angles and velocities of both.
PendulumState StateBetween(const PendulumState& a, const PendulumState& b, double h, double share);

/// The angle of the joint that the motor drives (rad).
double MotorAngle(const Plant& plant, const PendulumState& s);

/// `angle` wrapped to [-π, π], rad.
double Wrapped(double angle);

/// Angles of both links from straight up, rad, in [-π, π]; link 2 by its absolute angle.
std::array<double, 2> Lean(const PendulumState& s);

}  // namespace upswing
