#include "extras/realaigym/boards.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/json.h"
#include "base/text.h"
#include "extras/machine/drive/control_loop.h"
#include "extras/realaigym/hardware.h"
#include "runs/plant_file.h"

namespace upswing::realaigym {

std::string OtherPlant(const MachinePolicy& policy) {
  const Plant& plant = policy->plant;
  Plant board = ReadPlantFile("realaigym").plant;
  board.actuated_joint = plant.actuated_joint;
  return PlantValues(plant) == PlantValues(board) ? "" : PlantText(plant);
}

ControllerMaker ControllersOf(const MachinePolicy& policy) {
  return [policy, motor = MotorOf(RobotOf(*policy))]() -> CycleController {
    return [loop = PerCycle(ControllerOf(policy), kBoardHz), motor,
            begin = -1.0](const CycleInput& in) mutable -> Joints {
      if (begin < 0) begin = in.time;
      constexpr double kRounding = 1e-3;  // share of a step
      const auto step = static_cast<int64_t>((in.time - begin) / kBoardTimestep + kRounding);
      Joints torque{};
      torque[motor] = loop(step, {in.angle[0], in.angle[1], in.velocity[0], in.velocity[1]});
      return torque;
    };
  };
}

MachineLog NominalLog(const MachinePolicy& policy) {
  return SimulateEpisode(RobotOf(*policy), {}, ControllersOf(policy)());
}

BoardReport ScoreOnBoard(const MachinePolicy& policy, uint64_t seed, ThreadPool& pool,
                         const Progress& progress) {
  BoardReport report{policy, OutcomeOf(NominalLog(policy)), {}};
  const ControllerMaker make = ControllersOf(policy);
  const std::vector<RobustnessCase> cases = RobustnessCases(seed);
  const auto ends = RunAll(static_cast<int>(cases.size()), &pool, progress, [&](int i) {
    return EndOf(RobotOf(*policy), cases[i].episode, make());
  });
  report.robustness = JudgeRobustness(cases, ends);
  return report;
}

std::string BoardJson(const BoardReport& report) {
  nlohmann::ordered_json j;
  j["policy"] = report.policy->name;
  j["robot"] = NameOf(RobotOf(*report.policy));
  j["performance"] = OutcomeJson(report.nominal);
  j["robustness"] = {{"score", report.robustness.score()}};
  for (size_t row = 0; row < kRobustnessRows; ++row) {
    j["robustness"][kRobustnessRowNames.at(row)] = report.robustness.rows.at(row);
  }
  for (const RobustnessCurve& curve : report.robustness.curves) {
    j["curves"].push_back({{"name", curve.name}, {"values", curve.values}, {"share", curve.share}});
  }
  j["simulations"] = kBoardSimulations;
  return PrintableJson(j);
}

Moments UptimeReport::scores() const {
  std::vector<double> scores;
  for (const UptimeRun& run : runs) scores.push_back(run.score);
  return MomentsOf(scores);
}

Interval UptimeReport::interval() const {
  const auto [mean, deviation] = scores();
  const double half = 1.96 * deviation / std::sqrt(static_cast<double>(runs.size()));
  return {mean - half, mean + half};
}

MachineLog UptimeLog(const MachinePolicy& policy, uint64_t seed) {
  return SimulateEpisode(RobotOf(*policy), {}, WithResets(ControllersOf(policy), {}, seed),
                         kUptimeSeconds);
}

std::vector<UptimeRun> ScoreUptime(const MachinePolicy& policy, uint64_t seed, int count,
                                   ThreadPool& pool, const Progress& progress) {
  return RunAll(count, &pool, progress,
                [&](int i) { return UptimeOf(UptimeLog(policy, seed + i)); });
}

std::string UptimeJson(const UptimeReport& report) {
  const Interval interval = report.interval();
  const auto [mean, deviation] = report.scores();
  nlohmann::ordered_json j{{"policy", report.policy->name},
                           {"robot", NameOf(RobotOf(*report.policy))},
                           {"mean_score", mean},
                           {"interval", {interval.low, interval.high}},
                           {"deviation", deviation}};
  for (const UptimeRun& run : report.runs) {
    j["runs"].push_back({{"score", run.score}, {"swing_ups", run.swing_ups}});
  }
  return PrintableJson(j);
}

std::string BoardCsv(const MachineLog& log) {
  std::string csv(kBoardHeader);
  for (int k = 0; k < log.rows(); ++k) {
    csv += FormatNumber(std::round(log.time[k] * 1e6) / 1e6);
    for (const Joints& pair : {log.angle[k], log.velocity[k], log.commanded[k]}) {
      csv += Concat(",", FormatNumber(pair[0]), ",", FormatNumber(pair[1]));
    }
    csv += '\n';
  }
  return csv;
}

}  // namespace upswing::realaigym
