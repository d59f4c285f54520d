#pragma once

#include <array>

#include "base/options.h"
#include "pendulum/plant.h"

/// The task of the double pendulum as formulas: observation, reward and goal.
///
/// Symbols: q1, q2 joint angles (rad; both 0 hanging, q2 relative to link 1), w1, w2 their
/// velocities (rad/s), m mass (kg), l length (m), g gravity (m/s²), tau the motor's torque (N·m).
namespace upswing {

/// The task's name.
inline constexpr const char* kDoublePendulum = "double-pendulum";

/// Length of an evaluation episode, of its first part that counts for the return, and of its last
/// part throughout which both links must be inverted (s).
inline constexpr double kEvaluationSeconds = 20, kReturnSeconds = 10, kHoldSeconds = 10;

/// The links whose energy the task takes: thin rods, whose inertia is m l²/12. If the plant has own
/// links, those of LinksOf.
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
/// are a heuristic: a swing-up from hanging stays well within them.
inline constexpr double kMaxVelocity1 = 10.0;
inline constexpr double kMaxVelocity2 = 20.0;

/// The observation [cos q1, sin q1, w1/kMaxVelocity1, cos q2, sin q2, w2/kMaxVelocity2, Ê, ĥ], with
/// Ê = NormalizedEnergy and ĥ = TipHeight over l1 + l2, in [-1, 1].
std::array<float, kObservationSize> Observe(const Plant& plant, const PendulumState& s);

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

}  // namespace upswing
