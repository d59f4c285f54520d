#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// Logs of machines with two joints, real or simulated: one row for each cycle of the control loop.
namespace upswing {

/// One number for each joint.
using Joints = std::array<double, 2>;

/// A log in SI units. Angles are those of PendulumState: 0 hanging, joint 2 relative to link 1. All
/// torques act at the joints, after the gears. The vectors have a value for each row, or are empty
/// if the file does not have the quantity.
struct MachineLog {
  std::string name;  // of the file, for messages
  std::vector<double> time;        // clock at the end of the cycle, s
  std::vector<Joints> angle;       // rad, never empty
  std::vector<Joints> velocity;    // rad/s
  std::vector<Joints> commanded;   // sent to the motors in this cycle, before clipping, N·m
  std::vector<Joints> measured;    // from the motors' currents, N·m
  std::vector<Joints> push;        // added to the commanded torque after clipping, N·m

  int rows() const { return static_cast<int>(time.size()); }
};

}  // namespace upswing
