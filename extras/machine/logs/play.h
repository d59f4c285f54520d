#pragma once

#include <optional>
#include <span>

#include "extras/machine/logs/log.h"

/// Play of gears and couplings, by the equations of motion.
namespace upswing::machine {

/// The part that crosses the play of a joint.
enum class PlayKind {
  kEncoder,  // the link drags its encoder along, within the play
  kGear,     // the motor turns the link within the play, and the encoder is at the motor
};

/// A play that explains the motion.
struct Play {
  int joint = 0;     // 1 or 2
  double width = 0;  // rad
  PlayKind kind = PlayKind::kEncoder;
  // Share of the motion that the equations leave unexplained, with the play and without it.
  double left = 0, left_without = 0;
};

/// The play that explains the motion of logs far better than no play; nothing if there is none.
/// `time`: natural time of the machine, s. `delay`: of its motors, s. `motor`: joint of the
/// controller's motor, 1 or 2.
std::optional<Play> FindPlay(std::span<const MachineLog> logs, double time, double delay,
                             int motor);

}  // namespace upswing::machine
