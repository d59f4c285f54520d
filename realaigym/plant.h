#pragma once

#include <array>
#include <cstddef>

/// The double pendulum of the benchmark RealAIGym (docs/realaigym.md), vectorised over a block of
/// simulations.
///
/// Symbols: q1, q2 joint angles (rad; 0 hanging, q2 relative to link 1), w1, w2 their velocities
/// (rad/s), tau torque (N·m). Unlike sim/double_pendulum.h, inertias are about the joints, and
/// joints have dry friction cf·atan(100 w).
namespace upswing {

inline constexpr double kBoardTimestep = 0.002;     // s, of a Runge-Kutta step and of control
inline constexpr int kBoardSteps = 5000;            // of a simulation, 10 s
inline constexpr double kBoardTorqueLimit = 6;      // of the motor, N·m
inline constexpr double kBoardGearRatio = 6;        // of the motors
inline constexpr double kBoardFrictionSlope = 100;  // s/rad

/// A plant; the defaults are design C.1, model 1.1, that of the board.
struct BoardPlant {
  double mass1 = 0.5234602302310271, mass2 = 0.6255677234177437;           // kg
  double length1 = 0.2, length2 = 0.3;                                     // m
  double center1 = 0.2, center2 = 0.25569305436052964;                     // m from the joint
  double inertia1 = 0.031887199591513114, inertia2 = 0.05086984812807257;  // kg·m²
  double rotor_inertia = 0;                                                // of a motor, kg·m²
  double damping1 = 0, damping2 = 0;                                       // N·m·s/rad
  double friction1 = 0, friction2 = 0;                                     // N·m
  double gravity = 9.81;                                                   // m/s²

  bool has_friction() const {
    return damping1 != 0 || damping2 != 0 || friction1 != 0 || friction2 != 0;
  }
};

/// q1, q2, w1, w2.
using BoardState = std::array<double, 4>;

/// Simulations that are stepped together.
inline constexpr size_t kBoardBlock = 64;
using Lanes = std::array<double, kBoardBlock>;

/// Up to kBoardBlock pendulums, each number as an array over them; those that are not used hang.
struct alignas(64) BoardBlock {
  Lanes q1{}, q2{}, w1{}, w2{};  // state
  Lanes tau1{}, tau2{};          // held during a step
  Lanes tip{};                   // height of the tip before the last step, m

  BoardBlock();
  void SetPlant(size_t lane, const BoardPlant& plant);
  void SetState(size_t lane, const BoardState& s);
  BoardState state(size_t lane) const { return {q1[lane], q2[lane], w1[lane], w2[lane]}; }

  // Of M q̈ = f: M = [[A + 2 b c2, C + b c2], [·, D]], moments of gravity G, friction d and cf.
  Lanes A, b, C, D, G1, G2, d1, d2, cf1, cf2, length1, length2;
  bool friction = false;  // whether any has it
};

/// Makes one classical Runge-Kutta step of kBoardTimestep.
void Advance(BoardBlock& block);

/// q̈ of the states as they are, rad/s².
std::array<Lanes, 2> Accelerations(const BoardBlock& block);

/// Kinetic and potential energy, the latter 0 at the height of the pivot (J).
double Energy(const BoardPlant& plant, const BoardState& s);

}  // namespace upswing
