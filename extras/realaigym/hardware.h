#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "extras/machine/logs/log.h"
#include "extras/realaigym/rules.h"

/// Scores of runs on the real robot by the rules of RealAIGym's hardware boards, version 2
/// (docs/howto/realaigym.md).
namespace upswing::realaigym {

/// The normalisers of a hardware board. Measured torque is rough, so cost and smoothness have wider
/// ones than in simulation. The board of pushed acrobots has its own.
ScoreScales HardwareScales(Robot robot, bool pushed);

/// The robot of a log: the joint with more commanded torque has the motor.
Robot RobotIn(const MachineLog& log);

/// Shortest run that can succeed, s.
inline constexpr double kHardwareSeconds = 0.99 * kBoardSeconds;

/// Measures of a run, real or simulated: angles and velocities as logged, torque as commanded. A
/// run that is shorter than kHardwareSeconds is a failure. Throws BadInput if the log lacks
/// velocities or commanded torques.
BoardOutcome OutcomeOf(const MachineLog& log);

struct HardwareRun {
  std::string name;
  double seconds = 0;  // length of the run
  BoardOutcome outcome;
  double score = 0;
};

/// Scores of runs of a controller.
struct HardwareReport {
  Robot robot = Robot::kPendubot;
  bool pushed = false;
  std::vector<HardwareRun> runs;

  int successes() const;
  double mean() const;  // of the scores
};

/// Scores runs of one robot, all with pushes or all without. Without `robot`, RobotIn finds it.
/// Throws BadInput.
HardwareReport ScoreHardware(std::span<const MachineLog> logs, std::optional<Robot> robot);

/// The measures of a run, its penalties and its score.
nlohmann::ordered_json OutcomeJson(const BoardOutcome& outcome, const ScoreScales& scales = {});
std::string HardwareJson(const HardwareReport& report);

}  // namespace upswing::realaigym
