#include "extras/realaigym/hardware.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/json.h"
#include "base/text.h"
#include "extras/realaigym/uptime.h"

namespace upswing::realaigym {
namespace {

/// Start of the last stretch above the line, s; the end if the tip is below at the end.
double SwingUpSeconds(const MachineLog& log) {
  // The benchmark's program does not test the last row.
  int first = log.rows() - 1;
  while (first > 0 && AboveLine(log.angle[first - 1])) --first;
  return log.time[first];
}

/// Population standard deviation of the torque's change per row.
double Smoothness(const std::vector<Joints>& torque, int joint) {
  const auto changes = static_cast<double>(torque.size() - 1);
  const double mean = (torque.back()[joint] - torque.front()[joint]) / changes;
  double sum = 0;
  for (size_t k = 0; k + 1 < torque.size(); ++k) {
    const double e = torque[k + 1][joint] - torque[k][joint] - mean;
    sum += e * e;
  }
  return std::sqrt(sum / changes);
}

void ExpectSame(const MachineLog& log, const HardwareReport& report, std::optional<Robot> robot) {
  const bool pushed = !log.push.empty();
  if ((robot || RobotIn(log) == report.robot) && pushed == report.pushed) return;
  const auto kind = [](Robot of, bool with_pushes) {
    return Concat("the ", NameOf(of), with_pushes ? " with pushes" : " without pushes");
  };
  throw BadInput(Concat("realaigym hardware: expected runs of ", kind(report.robot, report.pushed),
                        " as ", report.runs.front().name, ", got ", kind(RobotIn(log), pushed),
                        " in ", log.name));
}

}  // namespace

ScoreScales HardwareScales(Robot robot, bool pushed) {
  const bool narrow = robot == Robot::kAcrobot && pushed;
  return {.torque_cost = narrow ? 20.0 : 100.0, .smoothness = narrow ? 1.0 : 4.0};
}

Robot RobotIn(const MachineLog& log) {
  Joints sum{};
  for (const Joints& u : log.commanded) {
    for (int j = 0; j < 2; ++j) sum[j] += u[j] * u[j];
  }
  return sum[1] > sum[0] ? Robot::kAcrobot : Robot::kPendubot;
}

BoardOutcome OutcomeOf(const MachineLog& log) {
  if (log.velocity.empty() || log.commanded.empty()) {
    throw BadInput(Concat(log.name, ": expected ",
                          log.velocity.empty() ? "velocities" : "commanded torques",
                          ", which the rules need, got none"));
  }
  BoardOutcome o;
  const std::vector<Joints>& u = log.commanded;
  for (int k = 0; k + 1 < log.rows(); ++k) {
    const double dt = log.time[k + 1] - log.time[k];
    for (int j = 0; j < 2; ++j) {
      o.energy += std::abs((log.angle[k + 1][j] - log.angle[k][j]) * u[k][j]);
      o.torque_cost += u[k][j] * u[k][j] * dt;
      o.velocity_cost += log.velocity[k][j] * log.velocity[k][j] * dt;
    }
  }
  for (const Joints& torque : u) {
    o.max_torque = std::max({o.max_torque, std::abs(torque[0]), std::abs(torque[1])});
  }
  o.smoothness = Smoothness(u, 0) + Smoothness(u, 1);
  o.swing_up_seconds = SwingUpSeconds(log);
  const double end = log.time.back();
  o.above_line = o.swing_up_seconds < end && end >= kHardwareSeconds;
  if (o.above_line && o.max_torque == 0) {
    throw BadInput(
        Concat(log.name, ": expected commanded torques other than 0 of a run that swings up"));
  }
  if (!o.above_line) o.swing_up_seconds = end;
  return o;
}

int HardwareReport::successes() const {
  return static_cast<int>(
      std::ranges::count_if(runs, [](const HardwareRun& run) { return run.outcome.above_line; }));
}

double HardwareReport::mean() const {
  double sum = 0;
  for (const HardwareRun& run : runs) sum += run.score;
  return runs.empty() ? 0 : sum / static_cast<double>(runs.size());
}

HardwareReport ScoreHardware(std::span<const MachineLog> logs, std::optional<Robot> robot) {
  HardwareReport report;
  for (const MachineLog& log : logs) {
    if (report.runs.empty()) {
      report.robot = robot.value_or(RobotIn(log));
      report.pushed = !log.push.empty();
    } else {
      ExpectSame(log, report, robot);
    }
    const BoardOutcome outcome = OutcomeOf(log);
    const double score = PerformanceScore(outcome, HardwareScales(report.robot, report.pushed));
    report.runs.push_back({log.name, log.time.back(), outcome, score});
  }
  return report;
}

nlohmann::ordered_json OutcomeJson(const BoardOutcome& o, const ScoreScales& scales) {
  return {{"swung_up", o.above_line},
          {"swing_up_seconds", o.swing_up_seconds},
          {"energy", o.energy},
          {"torque_cost", o.torque_cost},
          {"smoothness", o.smoothness},
          {"velocity_cost", o.velocity_cost},
          {"max_torque", o.max_torque},
          {"penalties", PerformancePenalties(o, scales)},
          {"score", PerformanceScore(o, scales)}};
}

std::string HardwareJson(const HardwareReport& report) {
  nlohmann::ordered_json j;
  j["robot"] = NameOf(report.robot);
  j["pushed"] = report.pushed;
  j["runs"] = nlohmann::ordered_json::array();
  const ScoreScales scales = HardwareScales(report.robot, report.pushed);
  for (const HardwareRun& run : report.runs) {
    nlohmann::ordered_json one{{"name", run.name}, {"seconds", run.seconds}};
    one.update(OutcomeJson(run.outcome, scales));
    j["runs"].push_back(std::move(one));
  }
  j["successes"] = report.successes();
  j["mean_score"] = report.mean();
  return PrintableJson(j);
}

}  // namespace upswing::realaigym
