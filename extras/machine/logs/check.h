#pragma once

#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "extras/machine/logs/log.h"

/// Checks of a machine's log for faults of sensors, columns and units, without a model of the
/// machine. docs/reference/machine-log.md lists the checks.
namespace upswing::machine {

enum class Severity { kNote, kWarning, kFault };
const char* NameOf(Severity severity);

/// The aspect of a log that a finding is about.
enum class Aspect { kClock, kAngle, kVelocity, kTorque, kMotion };
const char* NameOf(Aspect aspect);

/// Rows of the file, numbered from 1, with their times.
struct LogRows {
  int first = 0, last = 0;
  double begin = 0, end = 0;  // s
};

/// Numbers of a finding by name, for JSON, in SI units.
using Numbers = std::vector<std::pair<std::string, double>>;

/// A result of a check. A fault misleads an identification that uses the log as it is.
struct Finding {
  Aspect aspect = Aspect::kClock;
  int joint = 0;  // 1 or 2; 0: the whole log
  Severity severity = Severity::kNote;
  std::string text;             // one line
  std::optional<LogRows> rows;  // nothing: all rows
  Numbers numbers;
};

/// The findings about a file.
struct LogCheck {
  std::string name;
  int rows = 0, pieces = 0;
  double seconds = 0;  // length of the pieces together
  std::vector<ReadColumn> columns;
  std::vector<Finding> findings;

  bool faulty() const;
};

/// Checks the pieces of a file; see ReadLog. `name` is the file's.
LogCheck CheckLog(const std::string& name, std::span<const MachineLog> pieces);

/// `rows 12 to 40 (0.02 to 0.08 s)`.
std::string RowsText(const LogRows& rows);

std::string CheckJson(std::span<const LogCheck> checks);

/// Draws angles, velocities, torques and cycle times with the findings' rows marked, as .svg or
/// .png.
void DrawCheck(const LogCheck& check, std::span<const MachineLog> pieces,
               const std::filesystem::path& file);

/// What a finding is about, such as `velocity 2`.
std::string AboutText(const Finding& finding);

/// Reads logs in the order of their names. Calls `warn` with a line about each one that has faults.
/// Throws BadInput as ReadLog does, and for a log that is given twice.
std::vector<MachineLog> ReadCheckedLogs(std::span<const std::string> files,
                                        const std::string& columns,
                                        const std::function<void(const std::string&)>& warn);

// The checks, each of which appends its findings.
using Findings = std::vector<Finding>;
using Pieces = std::span<const MachineLog>;

/// Appends findings about an aspect of a joint (1 or 2; 0: the whole log).
struct Reporter {
  Findings& findings;
  Aspect aspect;
  int joint = 0;

  void operator()(Severity severity, const std::string& text, std::optional<LogRows> rows = {},
                  const Numbers& numbers = {}) const {
    findings.push_back({aspect, joint, severity, text, rows, numbers});
  }
};

/// Rate, jitter, lost cycles and gaps.
void CheckClock(Pieces pieces, Findings& findings);
/// Rows that are lost or duplicated without a trace in a clock that counts cycles of `cycle` s.
void CheckLostRows(Pieces pieces, double cycle, const Reporter& report);
/// Resolution, saturation and stuck encoders.
void CheckAngles(Pieces pieces, Findings& findings);
/// Angles that jump: wrapped ones, wrong samples, and encoders that slip.
void CheckJumps(Pieces pieces, Findings& findings);
/// Unit, sign, joint and saturation of the velocities, compared with differences of the angles.
void CheckVelocities(Pieces pieces, Findings& findings);
/// Delay, lag, gain, unit and joint of the measured torque, compared with the commanded one.
void CheckTorques(Pieces pieces, Findings& findings);
/// Joints that do not move, motion that grows without torque, rest where nothing holds it.
void CheckMotion(Pieces pieces, Findings& findings);
/// Encoders that stick, by the equations of motion.
void CheckStuck(Pieces pieces, Findings& findings);
/// Speeds that no pendulum reaches: it would turn round several times within a swing.
void CheckSpeeds(Pieces pieces, Findings& findings);
/// Signs, zeros, units and joints of angles and torques, by the equations of motion.
void CheckEquations(Pieces pieces, Findings& findings);

/// Whether there is a fault that the encoder of a joint (0 or 1) sticks or saturates.
bool IsStuck(const Findings& findings, int joint);

/// Whether the motor of a joint (0 or 1) reports torques without a command: more than idle motors
/// do, including motors whose rotors the other joint accelerates.
bool ActsWithoutCommand(Pieces pieces, int joint);

/// The pieces, with the measured torques less the torques that accelerate the rotors of idle
/// motors: an idle motor reports such a torque in the rows without a command. It must follow the
/// acceleration.
std::vector<MachineLog> WithoutRotors(Pieces pieces);

/// Rows `first` to `last` (indices) of a piece as rows of the file.
LogRows RangeOf(const MachineLog& piece, int first, int last);

/// Duration of a usual cycle, s: the mean of those between the quartiles. (Of a clock in whole
/// milliseconds the median of 2 and 3 ms would be wrong.)
double UsualCycle(Pieces pieces);

/// Central difference of a joint's angle at row k, 0 < k < rows - 1, rad/s; 0 if the clock stands
/// still.
double CentralDifference(const MachineLog& log, int k, int joint);

/// |speed| of a joint from row k - 1 to row k, rad/s; 0 beyond the piece's ends. A row that comes
/// early after a late one counts as a usual `cycle` (s).
double SpeedTo(const MachineLog& log, int joint, int k, double cycle);

/// The values of a quantity at a joint (0 or 1) in all pieces; empty if the log lacks it.
std::vector<double> ValuesOf(Pieces pieces, std::vector<Joints> MachineLog::*quantity, int joint);

/// Range of a joint's angle over all pieces: largest minus smallest, rad.
double AngleRange(Pieces pieces, int joint);

/// Step of a joint's encoder, rad: the smallest distance of two values. Nothing if other distances
/// are not multiples of it.
std::optional<double> QuantumOf(Pieces pieces, int joint);

/// QuantumOf, or the smallest distance of two angles of a joint, rad; 0 if it never moves.
double StepOf(Pieces pieces, int joint);

/// Sums over pairs (x, y), for the regression y ≈ offset + gain x.
struct Pairs {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;

  void Add(double a, double b) {
    n += 1;
    x += a;
    y += b;
    xx += a * a;
    xy += a * b;
    yy += b * b;
  }
  double Sxx() const { return xx - x * x / n; }
  double Sxy() const { return xy - x * y / n; }
  double Syy() const { return yy - y * y / n; }
  double gain() const { return Sxx() > 0 ? Sxy() / Sxx() : 0; }
  double correlation() const {
    const double product = Sxx() * Syy();
    return product > 0 ? Sxy() / std::sqrt(product) : 0;
  }
};

/// Smallest range of an angle for which its differences say anything about velocities, rad.
inline constexpr double kMoves = 0.05;

}  // namespace upswing::machine
