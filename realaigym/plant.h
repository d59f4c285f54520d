#pragma once

#include <array>
#include <cstddef>

#include "sim/manipulator.h"

/// The double pendulum of the benchmark RealAIGym (docs/howto/realaigym.md): its numbers, and the
/// constants of the equations of motion that follow. Unlike those of Plant, its inertias are about
/// the joints.
namespace upswing {

inline constexpr double kBoardTimestep = 0.002;  // s, of a Runge-Kutta step and of control
inline constexpr int kBoardSteps = 5000;         // of a simulation, 10 s
inline constexpr double kBoardTorqueLimit = 6;   // of the motor, N·m
inline constexpr double kBoardGearRatio = 6;     // of the motors

/// A plant; the defaults are design C.1, model 1.1, that of the board.
struct BoardPlant {
  double mass1 = 0.5234602302310271, mass2 = 0.6255677234174437;           // kg
  double length1 = 0.2, length2 = 0.3;                                     // m
  double center1 = 0.2, center2 = 0.25569305436052964;                     // m from the joint
  double inertia1 = 0.031887199591513114, inertia2 = 0.05086984812807257;  // kg·m²
  double rotor_inertia = 0;                                                // of a motor, kg·m²
  double damping1 = 0, damping2 = 0;                                       // N·m·s/rad
  double friction1 = 0, friction2 = 0;                                     // N·m
  double gravity = 9.81;                                                   // m/s²
};

Manipulator ManipulatorOf(const BoardPlant& plant);

/// q1, q2, w1, w2.
using BoardState = std::array<double, 4>;

/// Simulations that are stepped together.
inline constexpr size_t kBoardBlock = 64;
/// A number of each of them.
using Lanes = std::array<double, kBoardBlock>;

}  // namespace upswing
