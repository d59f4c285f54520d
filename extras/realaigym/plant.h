#pragma once

#include <cstdint>

#include "pendulum/equations.h"

namespace upswing::machine {}

/// The double pendulum of the benchmark RealAIGym (docs/howto/realaigym.md): its parameters, and
/// the constants of its equations of motion. Its inertias are about the joints, unlike those of
/// Plant.
namespace upswing::realaigym {

// The benchmark's robots are machines, with logs and twins.
using namespace machine;

inline constexpr double kBoardTimestep = 0.002;  // step of Runge-Kutta and of control, s
inline constexpr int64_t kBoardHz = 500;
static_assert(kBoardTimestep * kBoardHz == 1);
inline constexpr double kBoardSeconds = 10;     // length of a simulation and of a hardware run, s
inline constexpr double kBoardTorqueLimit = 6;  // of the motor, N·m
inline constexpr double kBoardGearRatio = 6;    // of the motors

/// A plant of the benchmark. The defaults are the board's plant: design C.1, model 1.1.
struct BoardPlant {
  double mass1 = 0.5234602302310271, mass2 = 0.6255677234174437;           // kg
  double length1 = 0.2, length2 = 0.3;                                     // m
  double center1 = 0.2, center2 = 0.25569305436052964;                     // m from the joint
  double inertia1 = 0.031887199591513114, inertia2 = 0.05086984812807257;  // kg·m²
  double rotor_inertia = 0;                                                // of each motor, kg·m²
  double damping1 = 0, damping2 = 0;                                       // N·m·s/rad
  double friction1 = 0, friction2 = 0;                                     // N·m
  double gravity = 9.81;                                                   // m/s²
};

inline Manipulator ManipulatorOf(const BoardPlant& p) {
  Manipulator m;
  m.J1 = p.inertia1 + p.mass2 * p.length1 * p.length1;
  m.J2 = p.inertia2;
  m.b = p.mass2 * p.length1 * p.center2;
  m.a = 0;
  m.G1 = p.gravity * (p.mass1 * p.center1 + p.mass2 * p.length1);
  m.G2 = p.gravity * p.mass2 * p.center2;
  m.d1 = p.damping1;
  m.d2 = p.damping2;
  m.f1 = p.friction1;
  m.f2 = p.friction2;
  m.AddRotors(p.rotor_inertia, kBoardGearRatio);
  return m;
}

}  // namespace upswing::realaigym
