#pragma once

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/options.h"
#include "base/policy_info.h"

/// The double pendulum and its task as formulas, without a simulator.
///
/// Symbols: q1, q2 joint angles (rad; both 0 hanging, q2 relative to link 1), w1, w2 their
/// velocities (rad/s), m mass (kg), l length (m), g gravity (m/s²), tau the motor's torque (N·m).
namespace upswing {

/// The task's name.
inline constexpr const char* kDoublePendulum = "double-pendulum";

/// Length of an evaluation episode, of its first part that counts for the return, and of its last
/// part throughout which both links must be inverted (s).
inline constexpr double kEvaluationSeconds = 20, kReturnSeconds = 10, kHoldSeconds = 10;

/// Time between two actions (s); the physics makes kPhysicsSteps steps in it.
inline constexpr double kControlPeriod = 0.02;

/// Constants of every plant; Mjcf uses the same values.
inline constexpr double kPhysicsTimestep = 0.005;  // s
inline constexpr int kPhysicsSteps = 4;            // per control period
static_assert(kPhysicsSteps * kPhysicsTimestep == kControlPeriod);
inline constexpr double kArmature = 0.01;       // of both joints, kg·m²
inline constexpr double kCapsuleRadius = 0.04;  // of both links, m
inline constexpr double kFrictionSlope = 100;   // of the dry friction's arctangent, s/rad

/// The parameters that can be set at run time. By default the links are solid capsules of a fixed
/// radius, whose inertia and centre of mass follow from mass and length.
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

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);

  bool has_dry_friction() const { return coulomb1 != 0 || coulomb2 != 0; }
  /// Whether a link has its own centre of mass or inertia, instead of a capsule's.
  bool has_own_links() const {
    return center1 != 0 || center2 != 0 || inertia1 != 0 || inertia2 != 0;
  }
};

/// Name and value of each parameter of the plant. Parameters that a file may lack (Option::implied)
/// are left out at their defaults.
std::vector<std::pair<std::string, double>> PlantValues(const Plant& plant);

/// Principal moments of inertia (kg·m²) of a solid capsule, across and along its axis: mass m (kg),
/// radius r (m), length l of its cylinder (m).
struct CapsuleInertia {
  double across, along;

  CapsuleInertia(double m, double r, double l);
};

/// A link as a rigid body: mass m (kg), length l (m), distance c of the centre of mass from the
/// link's joint (m), moment of inertia I about the centre of mass and the hinge's axis (kg·m²).
struct Link {
  double m, l, c, I;
};

/// The links that move: solid capsules, or with the plant's own centres of mass and inertias.
std::array<Link, 2> LinksOf(const Plant& plant);

/// The links whose energy the task takes: thin rods, whose inertia is m l²/12. If the plant has own
/// links, those of LinksOf.
std::array<Link, 2> TaskLinksOf(const Plant& plant);

/// Armature of joint 1, with the rotor of its motor, kg·m².
double Armature1(const Plant& plant);

/// State of the two joints.
struct PendulumState {
  double q1 = 0, q2 = 0;  // rad
  double w1 = 0, w2 = 0;  // rad/s
};

/// The state at the fraction `share` of the `h` seconds between states a and b. The path is the
/// cubic that matches the angles and velocities of both.
PendulumState StateBetween(const PendulumState& a, const PendulumState& b, double h, double share);

/// Mechanical energy (J) of TaskLinksOf, with heights measured from the pivot. It leaves out
/// armature and rotors.
double Energy(const Plant& plant, const PendulumState& s);

/// Energy at rest upright (J); the energy hanging at rest is its negative.
double EnergyTarget(const Plant& plant);

/// Energy mapped so that hanging at rest is 0 and upright at rest is 1.
double NormalizedEnergy(const Plant& plant, const PendulumState& s);

/// Height of the second link's tip over the pivot (m).
double TipHeight(const Plant& plant, const PendulumState& s);

/// Whether both links are within 30° of straight up; link 2 by its absolute angle q1 + q2.
bool Inverted(const PendulumState& s);

/// The angle of the joint that the motor drives (rad).
double MotorAngle(const Plant& plant, const PendulumState& s);

/// `angle` wrapped to [-π, π], rad.
double Wrapped(double angle);

/// Angles of both links from straight up, rad, in [-π, π]; link 2 by its absolute angle.
std::array<double, 2> Lean(const PendulumState& s);

inline constexpr int kObservationSize = 8;
/// Divisors of the velocities in observations (rad/s), so that all inputs have a similar size. They
/// are a heuristic: a swing-up from hanging stays well within them.
inline constexpr double kMaxVelocity1 = 10.0;
inline constexpr double kMaxVelocity2 = 20.0;

/// The observation [cos q1, sin q1, w1/kMaxVelocity1, cos q2, sin q2, w2/kMaxVelocity2, Ê, ĥ], with
/// Ê = NormalizedEnergy and ĥ = TipHeight over l1 + l2, in [-1, 1].
std::array<float, kObservationSize> Observe(const Plant& plant, const PendulumState& s);

/// Numbers that an observation may hold for each past control step, latest first: [Δw1, Δw2, tau].
/// Δw is the change of the velocities over kMemoryVelocity, tau the chosen torque over
/// kMemoryTorque. The plant's response reveals what the state lacks: masses, lengths, and torques
/// that are still delayed.
inline constexpr int kMemorySize = 3;
/// Number of values that identification adds to an observation; see pendulum/identification.h.
inline constexpr int kIdentifiedSize = 13;
inline constexpr double kConstantScale = 0.5;  // divisor of the constants' deviations
/// Number of past control steps in an observation of `obs_size` numbers.
constexpr int MemorySteps(int obs_size, bool identified = false) {
  return (obs_size - kObservationSize - (identified ? kIdentifiedSize : 0)) / kMemorySize;
}
/// Typical change of a velocity by the motor in one control period (rad/s), and the standard torque
/// limit (N·m).
inline constexpr double kMemoryVelocity = 1.0, kMemoryTorque = 5.0;

/// Writes the memory of an observation, its last 3 × `steps` numbers; the first numbers must be
/// filled already. `before` is the previous observation, at which the torque (N·m) was chosen.
void Remember(std::span<const float> before, double torque, int steps, std::span<float> obs);

/// Description, for a policy file, of observations with `memory` past steps and, if `identified`,
/// an identified plant.
ObservationInfo ObservationInfoOf(int64_t memory, bool identified = false);

/// Sign of each observation under the mirror symmetry, which negates angles, velocities and torque.
/// All numbers of the memory change sign.
inline constexpr std::array<float, kObservationSize> kMirrorSigns{1, -1, -1, 1, -1, -1, 1, 1};

inline constexpr int kRewardTerms = 5;
inline constexpr std::array<const char*, kRewardTerms> kRewardTermNames{
    "energy", "height", "balance", "velocity_penalty", "torque_penalty"};

/// The reward's signed terms for being in state s under torque tau (N·m), before weighting; the
/// reward is their sum:
///   energy   clip(Ê, 0, 1.5)
///   height   (ĥ + 1) / 2
///   balance  5 when inverted
///   velocity -0.01 (w1² + w2²) when inverted
///   torque   -0.05 tau² when inverted, -0.01 tau² otherwise
std::array<double, kRewardTerms> RewardTerms(const Plant& plant, const PendulumState& s,
                                             double tau);

/// Weights of the reward's terms; 0 leaves a term out.
struct RewardWeights {
  std::array<double, kRewardTerms> weight{1, 1, 1, 1, 1};

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// The model as MJCF, with all digits of the plant's numbers. Own links have an element `inertial`
/// each. A fixed tendon of length q1 - gear_ratio q2 stands for the
/// rotor of joint 2's motor. For dry friction, each joint has its c as
/// frictionloss and its slope as user data. The frictionloss constraint is switched off;
/// mujoco/model.h adds the friction where it finds the user data.
std::string Mjcf(const Plant& plant);

}  // namespace upswing
