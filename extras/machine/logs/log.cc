#include "extras/machine/logs/log.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <optional>
#include <utility>

#include "agents/toml_settings.h"
#include "base/csv.h"
#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "extras/machine/logs/units.h"
#include "os/file.h"
#include "os/gzip.h"

namespace upswing::machine {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostPieces = 10000;
constexpr double kMostMagnitude = 1e12;  // larger numbers are garbage, and their squares overflow

/// A quantity of each joint: its key in TOML files, and its columns in RealAIGym's logs of 2023 and
/// of 2022, without the joint's number.
struct JointQuantity {
  const char *key, *name, *old_name;
  const char* unit_of;  // quantity of its units
  std::array<LogColumn, 2> LogColumns::*columns;
  std::vector<Joints> MachineLog::*values;
};
constexpr JointQuantity kJointQuantities[] = {
    {"angle", "pos_meas", "pos", "angle", &LogColumns::angle, &MachineLog::angle},
    {"velocity", "vel_meas", "vel", "velocity", &LogColumns::velocity, &MachineLog::velocity},
    {"commanded", "tau_con", "tau", "torque", &LogColumns::commanded, &MachineLog::commanded},
    {"measured", "tau_meas", "", "torque", &LogColumns::measured, &MachineLog::measured},
    {"push", "tau_pert", "", "torque", &LogColumns::push, &MachineLog::push}};

/// A TOML value for an error: a text in quotes, a number or truth value without.
std::string Shown(const toml::node& node) {
  const std::string text = TextOf(node).value_or("another type");
  return node.is_string() ? Concat("\"", text, "\"") : text;
}

/// The number of a TOML node.
double NumberIn(const toml::node& node, Range range, const std::string& place) {
  const auto number = node.is_number() ? node.value<double>() : std::nullopt;
  if (number && std::isfinite(*number) && range.Contains(std::abs(*number))) return *number;
  throw BadInput(Concat(place, "expected a number of magnitude ", range.low, " to ", range.high,
                        ", got ", Shown(node)));
}

std::string TextIn(const toml::node& node, const std::string& place) {
  if (node.is_string() && !node.as_string()->get().empty()) return node.as_string()->get();
  throw BadInput(Concat(place, "expected the name of a column in quotes, got ", Shown(node)));
}

/// Reads `"name"` or `{column = "name", unit = "deg", factor = -1}`. Clocks and angles may have the
/// key `wrap`, angles `hanging`, too.
LogColumn ColumnIn(const toml::node& node, std::string_view quantity, const std::string& place) {
  const bool is_angle = quantity == "angle", wraps = is_angle || quantity == "time";
  LogColumn column;
  std::optional<ColumnUnit> unit;
  const toml::table* table = node.as_table();
  if (table == nullptr) column.name = TextIn(node, place);
  for (const auto& [key, value] : table == nullptr ? toml::table() : *table) {
    const std::string inner = Concat(place, key.str(), ": ");
    if (key == "column") {
      column.name = TextIn(value, inner);
    } else if (key == "unit") {
      unit = UnitNamed(TextOf(value).value_or(""), quantity, place);
    } else if (key == "factor") {
      column.factor = NumberIn(value, {1e-9, 1e9}, inner);
    } else if (key == "wrap" && wraps) {
      column.wrap = std::abs(NumberIn(value, {1e-9, 1e12}, inner));
    } else if (key == "hanging" && is_angle) {
      column.hanging = NumberIn(value, {0, 1e12}, inner);
    } else {
      const char* keys = " or factor";
      if (wraps) keys = is_angle ? ", factor, wrap or hanging" : ", factor or wrap";
      throw BadInput(Concat(place, "expected column, unit", keys, ", got ", key.str()));
    }
  }
  if (column.name.empty()) throw BadInput(Concat(place, "expected a column, got none"));
  if (!unit && std::abs(column.factor) != 1) unit = SiUnit(quantity);
  if (!unit) unit = UnitInName(column.name, quantity, place);
  column.unit = unit->name;
  column.scale = unit->scale * column.factor;
  return column;
}

/// Calls `f(key, column, quantity of its units)` for each column of numbers.
void ForEachColumn(auto& columns, const auto& f) {
  f("time", columns.time, "time");
  for (const JointQuantity& q : kJointQuantities) {
    for (int j = 0; j < 2; ++j) f(Concat(q.key, j + 1), (columns.*q.columns)[j], q.unit_of);
  }
}

/// Sets one key of a TOML file. Throws BadInput for an unknown one.
void SetColumn(LogColumns& columns, const std::string& key, const toml::node& node,
               const std::string& place) {
  if (key == "piece") {
    columns.piece = TextIn(node, place);
    return;
  }
  if (key == "absolute") {
    if (!node.is_boolean()) {
      throw BadInput(Concat(place, "expected true or false, got ", Shown(node)));
    }
    columns.absolute = node.as_boolean()->get();
    return;
  }
  if (key == "hanging") {
    throw BadInput(Concat(
        place, "expected it with an angle, such as angle1 = {column = \"a\", hanging = 180}"));
  }
  bool is_known = false;
  std::vector<std::string> keys;
  ForEachColumn(columns, [&](const std::string& name, LogColumn& column, const char* quantity) {
    keys.push_back(name);
    if (name != key) return;
    column = ColumnIn(node, quantity, place);
    is_known = true;
  });
  if (is_known) return;
  keys.insert(keys.end(), {"piece", "absolute"});
  throw BadInput(Concat(place, "expected one of ", Join(keys, ", "), DidYouMean(key, keys)));
}

/// Throws BadInput if the clock or an angle has no column, or if a column stands for two keys.
void CheckColumns(const LogColumns& columns, const std::string& where) {
  std::map<std::string, std::string> keys;
  const auto add = [&](const std::string& name, const std::string& key) {
    if (name.empty()) return;
    const auto [found, is_new] = keys.emplace(name, key);
    if (is_new) return;
    throw BadInput(Concat(where, ": expected a column for each key, got \"", Printable(name),
                          "\" for ", found->second, " and ", key));
  };
  ForEachColumn(columns,
                [&](const std::string& key, const LogColumn& column, std::string_view quantity) {
                  if (column.name.empty() && (quantity == "time" || quantity == "angle")) {
                    throw BadInput(Concat(where, ": expected the key ", key, ", got none"));
                  }
                  add(column.name, key);
                });
  add(columns.piece, "piece");
}

using Names = std::vector<std::string>;

bool HasName(const Names& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

/// The columns of a log of RealAIGym; nothing if the file's line of names is not that of one.
std::optional<LogColumns> RealAiGymColumns(const Names& names) {
  const bool is_old = !HasName(names, "pos_meas1");
  if (!HasName(names, "time") || !HasName(names, is_old ? "pos1" : "pos_meas1")) return {};
  LogColumns columns;
  columns.time.name = "time";
  for (const JointQuantity& q : kJointQuantities) {
    const std::string name = is_old ? q.old_name : q.name;
    const bool needed = q.values == &MachineLog::angle;
    for (int joint = 0; joint < 2; ++joint) {
      const std::string column = Concat(name, joint + 1);
      if (needed || HasName(names, column)) (columns.*q.columns)[joint].name = column;
    }
  }
  return columns;
}

/// The columns of a rollout that `simulate` or the page wrote, also of version 0.5.0; nothing if
/// the file's line of names is not that of one. Without torques of both joints, the motor is at
/// joint 1, as on the page.
std::optional<LogColumns> RolloutColumns(const Names& names) {
  const auto have = [&](std::initializer_list<const char*> all) {
    return std::ranges::all_of(all, [&](const char* name) { return HasName(names, name); });
  };
  const bool is_old = have({"t", "qpos0", "qpos1", "qvel0", "qvel1", "torque"});
  if (!is_old && !have({"t", "q1", "q2", "w1", "w2", "torque"})) return {};
  LogColumns columns;
  columns.torque_follows = true;
  columns.time.name = "t";
  columns.angle[0].name = is_old ? "qpos0" : "q1";
  columns.angle[1].name = is_old ? "qpos1" : "q2";
  columns.velocity[0].name = is_old ? "qvel0" : "w1";
  columns.velocity[1].name = is_old ? "qvel1" : "w2";
  const bool both = have({"torque1", "torque2"});
  columns.commanded[0].name = both ? "torque1" : "torque";
  if (both) columns.commanded[1].name = "torque2";
  return columns;
}

/// The columns of a file with known names. Throws BadInput.
LogColumns KnownColumns(const Names& names, const std::string& where) {
  std::optional<LogColumns> columns = RealAiGymColumns(names);
  if (!columns) columns = RolloutColumns(names);
  if (!columns) {
    throw BadInput(Concat(where,
                          ": expected the columns time and pos_meas1 or pos1, or --columns FILE "
                          "that names yours, got \"",
                          Shortened(Join(names, ","), 200), "\""));
  }
  ForEachColumn(*columns, [](const auto&, LogColumn& column, const char* quantity) {
    if (!column.name.empty()) column.unit = SiUnit(quantity).name;
  });
  return *columns;
}

/// Turns numbers of a column into SI units. Throws BadInput for a huge one.
void ToBaseUnits(std::vector<double>& values, const LogColumn& column, bool is_time,
                 const std::string& where) {
  for (size_t row = 0; row < values.size(); ++row) {
    double& x = values[row];
    x = (x - column.hanging) * column.scale;
    if (std::abs(x) <= kMostMagnitude) continue;
    throw BadInput(Concat(where, ": row ", row + 1, ": ", column.name,
                          ": expected a number of magnitude 0 to ", kMostMagnitude, ", got ", x,
                          is_time ? "; name the unit of the clock (ms, us, ns)" : ""));
  }
}

/// All rows of a file as one log, and the values of its column of pieces.
struct WholeLog {
  MachineLog log;
  std::vector<double> piece;  // empty: a single piece
};

/// Takes the values of a column out of a table that has it.
std::vector<double> TakeValues(std::vector<CsvColumn>& table, const std::string& name) {
  return std::move(std::ranges::find(table, name, &CsvColumn::name)->values);
}

WholeLog ReadRows(std::string_view csv, const LogColumns& columns, const std::string& where) {
  if (columns.velocity[0].name.empty() != columns.velocity[1].name.empty()) {
    throw BadInput(
        Concat(where, ": expected the velocities of both joints or of neither, got one"));
  }
  std::vector<std::string> names;
  if (!columns.piece.empty()) names.push_back(columns.piece);
  ForEachColumn(columns, [&](const auto&, const LogColumn& column, const char*) {
    if (!column.name.empty()) names.push_back(column.name);
  });
  std::vector<CsvColumn> table = ReadCsv(csv, names, where);
  WholeLog whole;
  if (!columns.piece.empty()) whole.piece = TakeValues(table, columns.piece);
  whole.log.time = TakeValues(table, columns.time.name);
  ToBaseUnits(whole.log.time, columns.time, /*is_time=*/true, where);
  for (const JointQuantity& q : kJointQuantities) {
    std::vector<Joints>& values = whole.log.*q.values;
    for (int joint = 0; joint < 2; ++joint) {
      const LogColumn& column = (columns.*q.columns)[joint];
      if (column.name.empty()) continue;
      std::vector<double> numbers = TakeValues(table, column.name);
      ToBaseUnits(numbers, column, /*is_time=*/false, where);
      values.resize(numbers.size());
      for (size_t row = 0; row < numbers.size(); ++row) values[row][joint] = numbers[row];
    }
  }
  return whole;
}

/// Undoes the wrapping of a joint's angle at multiples of `wrap` (rad): the first row is nearest to
/// hanging, and no step between rows is longer than half of it.
void Unwrap(std::vector<Joints>& angle, int joint, double wrap) {
  if (wrap == 0) return;
  double turns = 0, before = 0;
  for (Joints& row : angle) {
    double& x = row[joint];
    turns -= std::round((x - before) / wrap);
    before = x;
    x += turns * wrap;
  }
}

/// Undoes the wrapping of a clock (s) that begins again after `wrap` (s).
void UnwrapClock(std::vector<double>& time, double wrap) {
  if (wrap == 0 || time.empty()) return;
  double turns = 0, before = time.front();
  for (double& x : time) {
    if (x < before - wrap / 2) ++turns;
    before = x;
    x += turns * wrap;
  }
}

/// Turns torques that act from a row's angles on into the command that is sent at their reading:
/// that of the row before.
void ToCyclesEnds(std::vector<Joints>& commanded) {
  if (commanded.empty()) return;
  commanded.erase(commanded.begin());
  commanded.push_back(commanded.empty() ? Joints{} : commanded.back());  // it is not in the log
}

/// Makes the angles of a piece continuous, and those of joint 2 relative to link 1.
void FinishAngles(const LogColumns& columns, MachineLog& piece) {
  const auto& [first, second] = columns.angle;
  const double wrap1 = first.wrap * std::abs(first.scale);
  const double wrap2 = second.wrap * std::abs(second.scale);
  Unwrap(piece.angle, 0, wrap1);
  if (columns.absolute) {
    for (Joints& q : piece.angle) q[1] -= q[0];
    for (Joints& w : piece.velocity) w[1] -= w[0];
  }
  Unwrap(piece.angle, 1, columns.absolute ? std::max(wrap1, wrap2) : wrap2);
}

/// Sets a piece's clock to 0 at its first row. Rounds the times to the decimals that the file's
/// clock resolves (1 µs for seconds since 1970), so that its origin and unit change no bit.
void StartClock(MachineLog& piece) {
  const double begin = piece.time.front();
  const double largest = std::max(std::abs(begin), std::abs(piece.time.back()));
  const double rounding = 4 * (std::nextafter(largest, 2 * kMostMagnitude) - largest);
  const double ticks = std::pow(10, std::min(15.0, -std::ceil(std::log10(rounding))));
  for (double& time : piece.time) time = std::round((time - begin) * ticks) / ticks;
}

std::vector<ReadColumn> ReadColumnsOf(const LogColumns& columns) {
  std::vector<ReadColumn> read;
  ForEachColumn(columns, [&](const std::string& key, const LogColumn& column, const char*) {
    if (!column.name.empty()) read.push_back({key, column.name, column.unit, column.factor});
  });
  return read;
}

/// Why the clock of a log goes back before row `k`, and the remedy. A clock that begins again goes
/// back to where it began, one that is set goes back by less.
std::string CauseOfClockBack(const MachineLog& log, int k) {
  constexpr double kBegins = 0.05;  // of the time before
  const double begin = log.time.front(), before = log.time[k - 1];
  if (log.time[k] - begin <= kBegins * (before - begin)) {
    return "split logs that follow each other, name a column by piece, or the key wrap of a clock "
           "that starts again";
  }
  return Concat(
      "the clock was set back by ", FormatPlain(before - log.time[k], 3),
      " s, as NTP and users do; log a clock that is never set, such as CLOCK_MONOTONIC or "
      "Python's time.monotonic()");
}

void CheckRows(const MachineLog& log, const std::string& where) {
  if (log.rows() < 2) {
    throw BadInput(
        Concat(where, ": row ", log.first_row, ": expected at least 2 rows, got ", log.rows()));
  }
  for (int k = 1; k < log.rows(); ++k) {
    if (log.time[k] >= log.time[k - 1]) continue;
    throw BadInput(Concat(where, ": row ", log.first_row + k, ": time: expected at least ",
                          FormatNumber(log.time[k - 1]), " s as in the row before, got ",
                          FormatNumber(log.time[k]), " s: ", CauseOfClockBack(log, k)));
  }
}

}  // namespace

bool HasTorque(const std::vector<Joints>& torque, int joint) {
  return std::ranges::any_of(torque, [joint](const Joints& u) { return u[joint] != 0; });
}

bool HasCommand(std::span<const MachineLog> logs, int joint) {
  return std::ranges::any_of(
      logs, [&](const MachineLog& log) { return HasTorque(log.commanded, joint); });
}

bool HasCommands(std::span<const MachineLog> logs) {
  return HasCommand(logs, 0) || HasCommand(logs, 1);
}

MachineLog PieceOf(const MachineLog& whole, int begin, int end) {
  MachineLog piece;
  piece.name = whole.name;
  piece.first_row = whole.first_row + begin;
  piece.absolute = whole.absolute;
  piece.time.assign(whole.time.begin() + begin, whole.time.begin() + end);
  for (const JointQuantity& q : kJointQuantities) {
    const std::vector<Joints>& values = whole.*q.values;
    if (!values.empty()) (piece.*q.values).assign(values.begin() + begin, values.begin() + end);
  }
  return piece;
}

LogColumns ParseLogColumns(std::string_view text, const std::string& where) {
  LogColumns columns;
  for (const auto& [key, node] : ParseToml(text, where)) {
    const std::string name(key.str());
    SetColumn(columns, name, node, Concat(PlaceOf(node, where), ": ", name, ": "));
  }
  CheckColumns(columns, where);
  return columns;
}

std::vector<MachineLog> ParseLog(std::string_view csv, const LogColumns* columns,
                                 const std::string& where) {
  const LogColumns own = columns ? *columns : KnownColumns(CsvNames(csv, where), where);
  WholeLog whole = ReadRows(csv, own, where);
  const int rows = whole.log.rows();
  std::vector<MachineLog> pieces;
  if (whole.piece.empty()) {
    pieces.push_back(std::move(whole.log));
    pieces.back().name = where;
  }
  for (int begin = 0; begin < static_cast<int>(whole.piece.size());) {
    int end = begin;
    while (end < rows && whole.piece[end] == whole.piece[begin]) ++end;
    if (pieces.size() == kMostPieces) {
      throw BadInput(Concat(where, ": row ", begin + 1, ": ", columns->piece, ": expected at most ",
                            kMostPieces, " pieces, got more"));
    }
    pieces.push_back(PieceOf(whole.log, begin, end));
    pieces.back().name = Concat(where, " ", columns->piece, " ", FormatNumber(whole.piece[begin]));
    begin = end;
  }
  for (MachineLog& piece : pieces) {
    UnwrapClock(piece.time, own.time.wrap * std::abs(own.time.scale));
    CheckRows(piece, where);
    StartClock(piece);
    FinishAngles(own, piece);
    if (own.torque_follows) ToCyclesEnds(piece.commanded);
    piece.columns = ReadColumnsOf(own);
    piece.absolute = own.absolute;
  }
  return pieces;
}

std::string UnitsText(std::span<const ReadColumn> columns) {
  std::vector<std::string> texts, group;
  std::string unit;  // of the group
  const auto finish = [&] {
    if (!group.empty()) texts.push_back(Concat(Join(group, ", "), unit));
    group.clear();
  };
  for (const ReadColumn& column : columns) {
    std::string own = Concat(" [", column.unit, "]");
    if (column.factor != 1) own += Concat(" × ", FormatNumber(column.factor));
    if (own != unit) finish();
    unit = own;
    group.push_back(column.name);
  }
  finish();
  return Join(texts, "; ");
}

std::vector<MachineLog> ReadLog(const fs::path& file, const fs::path& columns) {
  LogColumns own;
  if (!columns.empty()) own = ParseLogColumns(ReadOwnFile(columns), columns.string());
  const std::string where = file.string();
  std::string text = ReadOwnFile(file);
  if (IsGzip(text)) text = Gunzip(text, where);
  return ParseLog(text, columns.empty() ? nullptr : &own, where);
}

}  // namespace upswing::machine
