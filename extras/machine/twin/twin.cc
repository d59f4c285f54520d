#include "extras/machine/twin/twin.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <utility>

#include "agents/toml_settings.h"
#include "base/error.h"
#include "base/text.h"
#include "pendulum/disturbance.h"
#include "pendulum/posterior.h"
#include "runs/covariance.h"
#include "runs/plant_file.h"

namespace upswing::machine {
namespace {

constexpr size_t kMostSessions = 1000;

/// The rows of a factor L of the covariance L L'. Throws BadInput if the matrix is not a
/// covariance.
std::vector<std::vector<double>> Factor(const Twin& twin, const std::string& where) {
  std::vector<std::vector<double>> rows;
  for (size_t i = 0; i < twin.uncertain.size(); ++i) {
    const double* row = &twin.covariance[i * twin.uncertain.size()];
    const std::string place = Concat(where, ": [covariance]: ", twin.uncertain[i], ": expected ");
    if (row[i] < 0) throw BadInput(Concat(place, "a variance of 0 or more, got ", row[i]));
    std::optional<std::vector<double>> L = FactorRow({row, row + i + 1}, rows);
    if (!L) throw BadInput(Concat(place, "this and the rows above to be positive semidefinite"));
    rows.push_back(std::move(*L));
  }
  return rows;
}

/// Reads the table [sessions]: for each session, a table of its values.
void ReadSessions(const toml::node& sessions, const std::string& where, Twin& twin) {
  if (!sessions.is_table()) {
    throw BadInput(
        Concat(PlaceOf(sessions, where), ": sessions: expected a table, got another type"));
  }
  const toml::table& table = *sessions.as_table();
  if (table.size() > kMostSessions) {
    throw BadInput(Concat(PlaceOf(table, where), ": [sessions]: expected at most ", kMostSessions,
                          " sessions, got ", table.size()));
  }
  for (const auto& [name, node] : table) {
    if (!node.is_table()) {
      throw BadInput(Concat(PlaceOf(node, where), ": ", Printable(name.str()),
                            ": expected a table, got another type"));
    }
    Session& session = twin.sessions.emplace_back();
    session.name = std::string(name.str());
    Twin own;
    const Options options = OptionsOf(own);
    ApplyTable(options, *node.as_table(), where, /*flat=*/true);
    for (const auto& [key, value] : *node.as_table()) {
      session.values.push_back(
          {std::string(key.str()), options.Find(key.str(), where).front()->number()});
    }
  }
}

/// The sensors of the control loop, and the time that a torque takes, as the age of what they show.
Disturbance DisturbanceOf(const Twin& twin) {
  Disturbance d;
  const double share = twin.sensors.velocity_share;
  d.sensors.latency =
      std::clamp(twin.loop.period + twin.actuator.delay + twin.actuator.lag, 0.0, kLongestLatency);
  if (twin.sensors.quantum > 0) {
    d.sensors.encoder_counts = std::round(2 * std::numbers::pi / twin.sensors.quantum);
  }
  d.sensors.velocity_window = std::min(twin.loop.period, kLongestWindow);
  d.sensors.velocity_filter = std::min(twin.loop.period * (1 - share) / share, kSlowestFilter);
  return d;
}

/// Throws BadInput for half a description of the motors, which would be no cogging in silence.
void CheckCogging(const Cogging& cogging, const std::string& where) {
  if (cogging.any()) return;
  bool given = cogging.slots > 0 || cogging.poles > 0;
  for (const auto& coefficients : cogging.coefficients) {
    for (const double c : coefficients) given = given || c != 0;
  }
  if (!given) return;
  throw BadInput(Concat(where, ": [cogging]: expected slots and poles above 0, got ", cogging.slots,
                        " and ", cogging.poles));
}

std::string Quoted(std::string_view text) {
  const std::string escaped = Replaced(Printable(text), "\\", "\\\\");
  return Concat("\"", Replaced(escaped, "\"", "\\\""), "\"");
}

}  // namespace

void Actuator::Describe(Options& o) {
  constexpr double kLongest = 0.1;  // s
  o.Section("actuator");
  o.Add(&delay, "delay", {-kLongest, kLongest}, "s",
        "time from reading the angles to the response of the torque sent with them");
  o.Add(&lag, "lag", {0, kLongest}, "s", "time constant of the torque");
  o.Add(&passive_limit, "passive_limit", {0, 1e6}, "N·m",
        "largest torque of the joint that is not actuated");
  o.Add(&current_delay, "current_delay", {-kLongest, kLongest}, "s",
        "time from the reported torque to the reading of the angles");
  o.Add(&current_inertia, "current_inertia", {0, 1e6}, "kg·m²",
        "part of the reported torque that opposes the joint's acceleration");
  o.Add(&torque_offset1, "torque_offset1", {-1e6, 1e6}, "N·m",
        "torque that joint 1 gets besides the motor's");
  o.Add(&torque_offset2, "torque_offset2", {-1e6, 1e6}, "N·m",
        "torque that joint 2 gets besides the motor's");
}

void MachineSensors::Describe(Options& o) {
  o.Section("sensors");
  o.Add(&quantum, "quantum", {0, 1}, "rad", "step of a measured angle");
  o.Add(&angle_range, "angle_range", {1, 1e6}, "rad", "largest measured angle");
  o.Add(&torque_quantum, "torque_quantum", {0, 1e6}, "N·m", "step of a reported torque");
  o.Add(&zero1, "zero1", {-1, 1}, "rad", "measured angle of joint 1 that hangs");
  o.Add(&zero2, "zero2", {-1, 1}, "rad", "measured angle of a straight joint 2");
  o.Add(&velocity_share, "velocity_share", {0.001, 1}, "",
        "share of the newest difference of angles in the low-passed velocity");
  o.Add(&velocity_dead_zone, "velocity_dead_zone", {0, 100}, "rad/s",
        "velocity below which the loop takes 0");
}

void LoopTiming::Describe(Options& o) {
  o.Section("loop");
  o.Add(&period, "period", {1e-4, 1}, "s", "median time between two cycles");
  o.Add(&jitter, "jitter", {0, 0.1}, "s", "standard deviation of this time");
  o.Add(&late_share, "late_share", kZeroToOne, "", "share of the cycles that are late");
  o.Add(&late, "late", {0, 1}, "s", "largest lateness of these");
}

bool IsTorqueOffset(std::string_view name) { return name.starts_with("torque_offset"); }

std::string SessionOf(const std::string& log) {
  constexpr int kFolders = 2;
  size_t begin = log.size();
  for (int i = 0; i <= kFolders && begin != std::string::npos && begin > 0; ++i) {
    begin = log.rfind('/', begin - 1);
  }
  std::string session = log.substr(begin < log.size() ? begin + 1 : 0);
  session.resize(std::min(session.size(), session.find(".csv", session.rfind('/') + 1)));
  constexpr std::string_view kDigits = "0123456789";
  const size_t last = session.find_last_of(kDigits);
  if (last == std::string::npos || session.find('/', last) != std::string::npos) return session;
  const size_t before = session.find_last_not_of(kDigits, last) + 1;
  return session.erase(before, last + 1 - before);
}

void Twin::Describe(Options& options) {
  plant.Describe(options);
  actuator.Describe(options);
  cogging.Describe(options);
  sensors.Describe(options);
  loop.Describe(options);
}

Twin ParseTwin(std::string_view text, const std::string& where) {
  toml::table table = ParseToml(text, where);
  Twin twin;
  const bool has_plant = table.contains("plant");
  twin.name = TakeText(table, "name", where);
  twin.distrust = TakeText(table, kDistrustKey, where);
  Covariance covariance = TakeCovariance(table, where);
  twin.uncertain = std::move(covariance.names);
  twin.covariance = std::move(covariance.values);
  if (const toml::node* sessions = table.get("sessions")) ReadSessions(*sessions, where, twin);
  // The disturbance follows from the other values.
  for (const char* key : {"sessions", "disturbance"}) table.erase(key);
  ApplyTable(OptionsOf(twin), table, where, /*flat=*/false);
  if (!has_plant) throw BadInput(Concat(where, ": expected a table [plant], got none"));
  CheckCogging(twin.cogging, where);
  if (!twin.uncertain.empty()) Factor(twin, where);
  return twin;
}

Twin ReadTwin(const std::string& name, const std::string& flag, const std::string& else_taken) {
  const auto [toml, where] = ReadPlantDocument(name, flag, else_taken);
  Twin twin = ParseTwin(toml, Printable(where));
  if (twin.name.empty()) twin.name = std::filesystem::path(name).stem().string();
  return twin;
}

std::string TwinText(const Twin& twin) {
  std::string text = Concat("name = ", Quoted(twin.name), "\n");
  if (!twin.distrust.empty()) text += Concat(kDistrustKey, " = ", Quoted(twin.distrust), "\n");
  text += "\n";
  const bool has_offset =
      twin.actuator.has_offset() || std::ranges::any_of(twin.uncertain, IsTorqueOffset);
  text += OptionsOf(twin).Toml(/*comments=*/true, [&](const Option& option) {
    if (IsTorqueOffset(option.name)) return has_offset;
    return option.section != "cogging" || twin.cogging.any();
  });
  const Disturbance disturbance = DisturbanceOf(twin);
  text += "\n" + OptionsOf(disturbance).Toml(/*comments=*/true, [](const Option&) { return true; });
  for (const Session& session : twin.sessions) {
    text += Concat("\n[sessions.", Quoted(session.name), "]\n");
    for (const auto& [setting, number] : session.values) {
      text += Concat(setting, " = ", FormatNumber(number), "\n");
    }
  }
  if (twin.uncertain.empty()) return text;
  text += "\n[covariance]  # of the values with these names, in this order\n";
  for (const std::string& a : twin.uncertain) {
    std::vector<std::string> row;
    for (const std::string& b : twin.uncertain) {
      row.push_back(FormatNumber(CovarianceOf(twin, a, b)));
    }
    text += Concat(a, " = [", Join(row, ", "), "]\n");
  }
  return text;
}

Plant UsualPlant() {
  return {.mass1 = 0.52,
          .mass2 = 0.63,
          .length1 = 0.2,
          .length2 = 0.3,
          .center1 = 0.2,
          .center2 = 0.26,
          .inertia1 = 0.01,
          .inertia2 = 0.01,
          .armature = 0.003};
}

Scale ScaleOverUsual(const Plant& plant) { return CarryOver(UsualPlant(), plant); }

double CovarianceOf(const Twin& twin, std::string_view a, std::string_view b) {
  const auto& names = twin.uncertain;
  const auto i = std::ranges::find(names, a) - names.begin();
  const auto j = std::ranges::find(names, b) - names.begin();
  const auto n = std::ssize(names);
  return i < n && j < n ? twin.covariance[static_cast<size_t>(i * n + j)] : 0;
}

Twin InSession(const Twin& twin, const MachineLog& log) {
  Twin own = twin;
  const std::string name = SessionOf(log.name);
  for (const Session& session : twin.sessions) {
    if (session.name != name) continue;
    const Options options = OptionsOf(own);
    for (const auto& [setting, number] : session.values) {
      *std::get<double*>(options.Get(setting)->target) = number;
      std::erase(own.uncertain, setting);  // it is known
    }
    own.covariance.clear();
    for (const std::string& a : own.uncertain) {
      for (const std::string& b : own.uncertain) own.covariance.push_back(CovarianceOf(twin, a, b));
    }
    break;
  }
  return own;
}

Twin DrawTwin(const Twin& twin, Rng& rng) {
  Twin drawn = twin;
  const std::vector<std::vector<double>> L = Factor(twin, twin.name);
  std::vector<double> z;
  for (size_t i = 0; i < L.size(); ++i) z.push_back(rng.Normal());
  const Options options = OptionsOf(drawn);
  for (size_t i = 0; i < L.size(); ++i) {
    const Option& option = *options.Get(twin.uncertain[i]);
    double& value = *std::get<double*>(option.target);
    for (size_t j = 0; j <= i; ++j) value += L[i][j] * z[j];
    const Range range = UncertainRange(option);
    value = std::clamp(value, range.low, range.high);
  }
  return drawn;
}

int ActuatedJoint(const MachineLog& log, const Twin& twin) {
  if (log.commanded.empty()) return 0;
  Joints largest{};
  for (const Joints& torque : log.commanded) {
    for (int j = 0; j < 2; ++j) largest[j] = std::max(largest[j], std::abs(torque[j]));
  }
  // A compensating motor adds friction compensation to a command within its limit.
  const double compensating = 2 * std::max(twin.actuator.passive_limit, 0.0);
  for (int j = 0; j < 2; ++j) {
    if (largest[1 - j] <= compensating && largest[j] > 2 * compensating) return j + 1;
  }
  return 0;
}

Joints TorqueLimits(const Twin& twin, int actuated_joint) {
  Joints limit{twin.plant.torque_limit, twin.plant.torque_limit};
  const int motor = actuated_joint - 1;  // index; -1: both joints drive
  if (motor >= 0) limit[1 - motor] = twin.actuator.passive_limit;
  return limit;
}

}  // namespace upswing::machine
