#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "extras/machine/drive/control_loop.h"
#include "extras/machine/drive/learn.h"

namespace upswing::machine {

/// The larger absolute value.
inline double LargerMagnitude(double a, double b) { return std::max(std::abs(a), std::abs(b)); }

/// Longest time of a try without balance, s by the scale of the machine.
inline constexpr double kLongestFall = 6;

/// Distance from hanging of links at rest that hang anywhere, rad.
inline constexpr double kAnyAngle = std::numbers::pi;

/// Limits and length of a run, and its purpose.
struct RunRules {
  Limits limits;
  double seconds = 0;        // longest time in which the controller drives
  double motion = INFINITY;  // longest time in which torques act, braking included, s
  bool is_try = false;       // whether balance or a hopeless state ends it; else an excitation
  double compensation = 0;   // share of the dry friction that motors compensate
  std::string log = {};      // file; empty: none
  Scale scale = {};          // natural units of the machine over those of UsualPlant
  // Distance from hanging at which links at rest are driven, rad. Dry friction may hold them there.
  double start_angle = kStartAngle;
};

struct RunOutcome {
  LoopSummary summary;
  double motion = 0;    // time in which the loop probed, drove or braked, s
  double balanced = 0;  // longest time for which both links were inverted, s
  std::string reason;   // of the supervisor; empty: none
  bool faulty = false;  // whether the reason is a fault, not a limit
};

/// Time of a run's `motion` that is left for the brake, s.
double BrakeReserve(const RunRules& rules);

/// Runs the control loop until it ends. A run in real time has its own thread, because fits with
/// real-time priority would starve the computer. `sensors`: range and step of the encoders.
RunOutcome RunCycles(const LearnConfig& c, const RunRules& rules, const MachineSensors& sensors,
                     Estimator estimator, MachineController own, MachineLink& link,
                     const std::function<bool()>& stop);

}  // namespace upswing::machine
