#pragma once

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/options.h"
#include "core/policy_info.h"

/// The double pendulum and its task as formulas, without a simulator.
///
/// Symbols: q1, q2 joint angles (rad; both 0 hanging, q2 relative to link 1), w1, w2 their
/// velocities (rad/s), m mass (kg), l length (m), g gravity (m/s²), tau the motor's torque (N·m).
namespace upswing {

/// The task's name.
inline constexpr const char* kDoublePendulum = "double-pendulum";

/// An evaluation episode (s), its part that counts for the return, and the part at its end
/// throughout which both links must be inverted.
inline constexpr double kEvaluationSeconds = 20, kReturnSeconds = 10, kHoldSeconds = 10;

/// Time between two actions (s); the physics makes several steps in it.
inline constexpr double kControlPeriod = 0.02;

/// Constants of every plant, the same as in Mjcf.
inline constexpr double kPhysicsTimestep = 0.005;  // s
inline constexpr int kPhysicsSteps = 4;            // in a control period
static_assert(kPhysicsSteps * kPhysicsTimestep == kControlPeriod);
inline constexpr double kArmature = 0.01;       // of both joints, kg·m²
inline constexpr double kCapsuleRadius = 0.04;  // of both links, m
inline constexpr double kFrictionSlope = 100;   // of the dry friction's arctangent, s/rad

/// The parameters that can be set at run time. The radius of the capsules is fixed; inertia and
/// centre of mass follow from mass and length.
struct Plant {
  double mass1 = 1.0, mass2 = 1.0;        // kg
  double length1 = 0.5, length2 = 0.5;    // m
  double damping1 = 0.2, damping2 = 0.2;  // N·m·s/rad
  double gravity = 9.81;                  // m/s², along -z
  double torque_limit = 5.0;              // N·m
  double actuated_joint = 1;          // which the motor drives: 1 (a pendubot) or 2 (an acrobot)
  double rotor_inertia = 0;           // of a motor at each joint, kg·m²
  double gear_ratio = 6;              // turns of a rotor for one of its joint
  double coulomb1 = 0, coulomb2 = 0;  // dry friction c atan(100 w) of each joint, N·m

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);

  bool has_dry_friction() const { return coulomb1 != 0 || coulomb2 != 0; }
};

/// Name and value of each of its parameters. Those that a file may lack (Option::implied) are left
/// out at their defaults.
std::vector<std::pair<std::string, double>> PlantValues(const Plant& plant);

/// Principal moments of inertia (kg·m²) of a solid capsule, across and along its axis: mass m (kg),
/// radius r (m), length l of its cylinder (m).
struct CapsuleInertia {
  double across, along;

  CapsuleInertia(double m, double r, double l);
};

/// Armature of joint 1 with the rotor of its motor, kg·m².
double Armature1(const Plant& plant);

/// State of the two joints.
struct PendulumState {
  double q1 = 0, q2 = 0;  // rad
  double w1 = 0, w2 = 0;  // rad/s
};

/// The state at a share of the `h` seconds from one state to another: along the cubic that has
/// their angles and velocities.
PendulumState StateBetween(const PendulumState& a, const PendulumState& b, double h, double share);

/// Mechanical energy (J), with thin-rod inertias m l²/12 and heights counted from the pivot.
double Energy(const Plant& plant, const PendulumState& s);

/// Energy at rest upright (J); hanging at rest it is the negative of this.
double EnergyTarget(const Plant& plant);

/// Energy mapped so that hanging at rest is 0 and upright at rest is 1.
double NormalizedEnergy(const Plant& plant, const PendulumState& s);

/// Height of the second link's tip over the pivot (m).
double TipHeight(const Plant& plant, const PendulumState& s);

/// Both links within 30° of straight up; the second by its absolute angle q1 + q2.
bool Inverted(const PendulumState& s);

/// The angle of the joint that the motor drives (rad).
double MotorAngle(const Plant& plant, const PendulumState& s);

/// An angle in [-π, π], rad.
double Wrapped(double angle);

/// How far both links lean from straight up, rad, in [-π, π]; the second by its absolute angle.
std::array<double, 2> Lean(const PendulumState& s);

inline constexpr int kObservationSize = 8;
/// Largest velocities (rad/s), a heuristic, by which the observation is divided: swinging up from
/// hanging stays well within them, so that all inputs are of similar size.
inline constexpr double kMaxVelocity1 = 10.0;
inline constexpr double kMaxVelocity2 = 20.0;

/// [cos q1, sin q1, w1/kMaxVelocity1, cos q2, sin q2, w2/kMaxVelocity2, Ê, ĥ] with Ê =
/// NormalizedEnergy and ĥ = TipHeight over l1 + l2, in [-1, 1].
std::array<float, kObservationSize> Observe(const Plant& plant, const PendulumState& s);

/// Memory that an observation may have of each past control step, the latest first: [Δw1, Δw2,
/// tau], the change of the velocities over kMemoryVelocity, and the chosen torque over
/// kMemoryTorque. The plant's response carries information that the state lacks: its masses and
/// lengths, and the torques that are still delayed.
inline constexpr int kMemorySize = 3;
/// How many numbers identification adds to an observation; see sim/identification.h.
inline constexpr int kIdentifiedSize = 13;
inline constexpr double kConstantScale = 0.5;  // by which the constants' deviations are divided
/// Number of past steps in an observation of `obs_size` numbers.
constexpr int MemorySteps(int obs_size, bool identified = false) {
  return (obs_size - kObservationSize - (identified ? kIdentifiedSize : 0)) / kMemorySize;
}
/// About the velocity that the motor can add in a control period (rad/s), and its usual limit
/// (N·m).
inline constexpr double kMemoryVelocity = 1.0, kMemoryTorque = 5.0;

/// Writes the memory of an observation, its last 3 × `steps` numbers; the first ones are there.
/// `before`: the observation before it, at which the torque (N·m) was chosen.
void Remember(std::span<const float> before, double torque, int steps, std::span<float> obs);

/// What a policy file says of observations that remember so many steps, and of whose plants are
/// identified.
ObservationInfo ObservationInfoOf(int64_t memory, bool identified = false);

/// Sign of each observation under the mirror symmetry, which negates angles, velocities and torque;
/// those of its memory are all negated.
inline constexpr std::array<float, kObservationSize> kMirrorSigns{1, -1, -1, 1, -1, -1, 1, 1};

inline constexpr int kRewardTerms = 5;
inline constexpr std::array<const char*, kRewardTerms> kRewardTermNames{
    "energy", "height", "balance", "velocity_penalty", "torque_penalty"};

/// The reward's terms for being in state s under torque tau (N·m), before weighting and signed,
/// so that their sum is the reward:
///   energy   clip(Ê, 0, 1.5)
///   height   (ĥ + 1) / 2
///   balance  5 when inverted
///   velocity -0.01 (w1² + w2²) when inverted
///   torque   -0.05 tau² when inverted, -0.01 tau² otherwise
std::array<double, kRewardTerms> RewardTerms(const Plant& plant, const PendulumState& s,
                                             double tau);

/// A weight for each term of the reward; 0 leaves it out.
struct RewardWeights {
  std::array<double, kRewardTerms> weight{1, 1, 1, 1, 1};

  /// One line per setting: name, range, unit, help.
  void Describe(Options& options);
};

/// The model as MJCF, with the plant's numbers to the last digit. Where there are rotors, that of
/// joint 2's motor is a fixed tendon of the length q1 - gear_ratio q2. Where there is dry friction,
/// each joint has its c as frictionloss, which as a constraint is switched off, and its slope as
/// user data, by which mujoco/model.h knows to add it.
std::string Mjcf(const Plant& plant);

}  // namespace upswing
