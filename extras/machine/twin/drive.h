#pragma once

#include <vector>

#include "extras/machine/logs/log.h"
#include "extras/machine/twin/twin.h"

/// The torques of a machine's motors over the time of a log.
namespace upswing::machine {

/// Derivatives of the torques of a drive, N·m/s.
struct DriveTangents {
  Joints by_delay{}, by_lag{};
};

/// The torques (N·m) at both joints over the time of a log.
class Drive {
 public:
  /// The torques that follow from the log's commands and pushes through the twin's motors; none if
  /// the log has no commands.
  static Drive Commanded(const MachineLog& log, const Twin& twin);
  /// The torques that the motors reported, interpolated and moved back by their age.
  static Drive Measured(const MachineLog& log, const Twin& twin);

  /// No torques yet, for motors with this delay and lag (s).
  Drive(double delay, double lag);
  /// Sends a command (N·m) at a time (s), later than those before it.
  void Add(double time, const Joints& command);
  /// Forgets commands that no longer matter at `time` and later.
  void Forget(double time);

  /// The torques at a time (s). `cursor`, first 0, speeds up calls with growing times. `tangents`,
  /// of a drive of commands, are filled unless null.
  Joints At(double time, int& cursor, DriveTangents* tangents = nullptr) const;

 private:
  /// Index of the last event up to a time; -1: before the first.
  int Find(double time, int& cursor) const;

  /// The torques at a time (s) without the delay, whose last event is `event`.
  Joints Interpolated(int event, double time) const;
  Joints Lagged(int event, double time, DriveTangents* tangents) const;

  double delay_, lag_;            // s
  bool is_measured_ = false;      // interpolates between events; else each event is a command
  std::vector<double> times_;     // (n) of the events, s
  std::vector<Joints> commands_;  // (n) from each event on, N·m; measured: the values there
  // Of commands only:
  std::vector<Joints> starts_;  // (n) torques at each event, N·m
  std::vector<Joints> slopes_;  // (n) their derivatives by the lag, N·m/s
};

}  // namespace upswing::machine
