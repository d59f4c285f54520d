#pragma once

#include "extras/machine/logs/log.h"

/// What a machine's encoders have to show.
namespace upswing::machine {

/// Readings of a joint show a motion if they differ by more than this many steps of its encoder.
inline constexpr double kVisibleSteps = 2.5;
/// Longest time for which an uncorrected prediction counts, s, by the scale of the machine.
inline constexpr double kResponseSeconds = 0.5;

/// The motion that the twin predicts. A measured angle and a prediction are compared as the
/// encoder shows them.
struct Expectation {
  bool known = false;           // whether a twin follows the motion
  Joints friction{};            // largest torque of dry friction, N·m
  Joints friction_deviation{};  // standard deviation of the twin's friction, N·m
  double delay_deviation = 0;   // standard deviation of the delay and lag of the motors, s

  // Motion of each joint since its encoder last showed one, predicted from the torques and the
  // other encoder, and its standard deviation, rad.
  Joints unseen{}, deviation{};

  // Motion since the torques began, rad: measured, and predicted without corrections with these
  // torques (driven) and without them (coasting). They end after kResponseSeconds.
  Joints measured{}, driven{}, coasting{};

  // The newest reading minus its prediction, rad, and the time since the reading before it, s.
  Joints innovation{};
  double gap = 0;
};

}  // namespace upswing::machine
