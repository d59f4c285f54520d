#pragma once

#include <array>

#include "pendulum/scale.h"

/// The task of the double pendulum as formulas: observation, reward and goal. MuJoCo trainings call
/// them; closed_form.cc computes the same for many environments at a time.
///
/// Symbols: q1, q2 joint angles (rad; 0 hanging, q1 = π and q2 = 0 upright; q2 relative to link 1),
/// w1, w2 velocities (rad/s), g gravity (m/s²). Of a link: m mass (kg), l length (m), c distance
/// from joint to centre of mass (m), I moment of inertia about that centre (kg·m²).
namespace upswing {

/// The task's name.
inline constexpr const char* kDoublePendulum = "double-pendulum";

/// An evaluation episode of the built-in plant starts near hanging and lasts kEvaluationSeconds.
/// Its return is the sum of the rewards of the first kReturnSeconds. It succeeds if Inverted holds
/// throughout the last kHoldSeconds (s). Other plants have multiples of these times, by
/// Scale::time.
inline constexpr double kEvaluationSeconds = 20, kReturnSeconds = 10, kHoldSeconds = 10;

/// The links in the energy of observation and reward: thin rods of inertia m l²/12. If the plant
/// sets a centre of mass or an inertia, they are the links of the equations of motion (LinksOf).
std::array<Link, 2> TaskLinksOf(const Plant& plant);

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

inline constexpr int kObservationSize = 8;
/// Divisors of the velocities in observations (rad/s), so that all inputs have a similar size. They
/// are a heuristic: a swing-up of the built-in plant from hanging stays well within them. Other
/// plants have multiples of them, by Scale::velocity.
inline constexpr double kMaxVelocity1 = 10.0;
inline constexpr double kMaxVelocity2 = 20.0;

/// The observation [cos q1, sin q1, w1/kMaxVelocity1, cos q2, sin q2, w2/kMaxVelocity2, Ê, ĥ], with
/// Ê = NormalizedEnergy and ĥ = TipHeight / (l1 + l2). ĥ is within [-1, 1].
std::array<float, kObservationSize> Observe(const Plant& plant, const PendulumState& s,
                                            const Scale& scale = {});

inline constexpr int kRewardTerms = 5;
inline constexpr std::array<const char*, kRewardTerms> kRewardTermNames{
    "energy", "height", "balance", "velocity_penalty", "torque_penalty"};

/// The signed terms of the reward Σ weight · term; all weights are 1 by default. In an environment,
/// s is the state at the end of a control step and tau (N·m) the motor's torque during it. Both
/// penalties count velocity and torque in units of `scale`.
std::array<double, kRewardTerms> RewardTerms(const Plant& plant, const PendulumState& s, double tau,
                                             const Scale& scale = {});

}  // namespace upswing
