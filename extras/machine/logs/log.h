#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Logs of machines with two joints, real or simulated: one row for each cycle of the control loop.
/// docs/reference/machine-log.md describes the files.
namespace upswing::machine {

/// One number for each joint.
using Joints = std::array<double, 2>;

/// A column of numbers that a log was read from.
struct ReadColumn {
  std::string key;   // such as `angle1`
  std::string name;  // in the file
  std::string unit;  // of the file's numbers
  double factor = 1;
};

/// The units of columns: `t [ms]; q1, q2 [rad]; u [Nm] × 0.05`.
std::string UnitsText(std::span<const ReadColumn> columns);

/// A log in SI units. Angles are those of PendulumState: 0 hanging, joint 2 relative to link 1. All
/// torques act at the joints, after the gears. The vectors have a value for each row, or are empty
/// if the file does not have the quantity.
///
/// In RealAIGym's logs, `time` is the host's clock at the end of each cycle, and the angles of row
/// k were read when commanded[k-1] was sent.
struct MachineLog {
  std::string name;               // of the file (and piece), for messages
  int first_row = 1;              // number of the first row in the file, from 1
  std::vector<double> time;       // clock at the end of the cycle, s; from 0, never decreases
  std::vector<Joints> angle;      // rad, never empty
  std::vector<Joints> velocity;   // rad/s
  std::vector<Joints> commanded;  // sent to the motors in this cycle, before clipping, N·m
  std::vector<Joints> measured;   // from the motors' currents, N·m
  std::vector<Joints> push;       // added to the commanded torque after clipping, N·m
  std::vector<ReadColumn> columns = {};
  bool absolute = false;  // whether the file's angles of joint 2 are against the vertical

  int rows() const { return static_cast<int>(time.size()); }
};

/// The rows `begin` to before `end` (indices) of a log, with its name.
MachineLog PieceOf(const MachineLog& whole, int begin, int end);

/// Whether the torques of a log, which may lack them, are ever other than 0 at a joint (0 or 1).
bool HasTorque(const std::vector<Joints>& torque, int joint);

/// Whether the commanded torques of any of these logs are ever other than 0 at a joint (0 or 1), or
/// at any joint.
bool HasCommand(std::span<const MachineLog> logs, int joint);
bool HasCommands(std::span<const MachineLog> logs);

/// A column of a file and its unit.
struct LogColumn {
  std::string name;    // empty: the file lacks the quantity
  double scale = 1;    // SI units in the file's unit, times the factor
  double wrap = 0;     // it starts again after this much, in the file's unit; 0: it does not
  double hanging = 0;  // the angle that hangs, in the file's unit
  double factor = 1;   // that the user states
  std::string unit;    // the file's
};

/// The columns of a log file, by quantity and joint.
struct LogColumns {
  LogColumn time;
  std::array<LogColumn, 2> angle, velocity, commanded, measured, push;
  std::string piece;      // column whose value changes where the next piece begins; may be empty
  bool absolute = false;  // whether angle and velocity of joint 2 are against the vertical
  // Whether the torque of a row acts from its own angles on, as in a rollout of `simulate`.
  bool torque_follows = false;
};

/// Parses a TOML text that names the columns of a file. Throws BadInput with `where` and the line.
LogColumns ParseLogColumns(std::string_view toml, const std::string& where);

/// Parses a CSV text. Without `columns`, the names must be those of RealAIGym's logs, or of a
/// rollout that `simulate` or the page wrote. Returns the pieces, each with at least two rows; most
/// files have a single piece. The clock of each piece begins at 0. Throws BadInput with `where` and
/// the line or row.
std::vector<MachineLog> ParseLog(std::string_view csv, const LogColumns* columns,
                                 const std::string& where);

/// Reads a CSV file, which may be compressed by gzip. `columns` is a TOML file that names its
/// columns, or empty for names that ParseLog knows. Throws BadInput.
std::vector<MachineLog> ReadLog(const std::filesystem::path& file,
                                const std::filesystem::path& columns = {});

}  // namespace upswing::machine
