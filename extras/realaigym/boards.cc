#include "extras/realaigym/boards.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/error.h"
#include "base/json.h"
#include "base/text.h"
#include "extras/machine/control_loop.h"
#include "extras/realaigym/hardware.h"
#include "pendulum/observation.h"
#include "runs/plant_file.h"

namespace upswing::realaigym {
namespace {

using nlohmann::ordered_json;

constexpr int64_t kBoardHz = 500, kPolicyHz = 50;
static_assert(kBoardTimestep * kBoardHz == 1 && kControlPeriod * kPolicyHz == 1);

/// Controller made by MachineControllerOf.
class PolicyController : public MachineController {
 public:
  explicit PolicyController(std::shared_ptr<const LoadedPolicy> loaded)
      : loaded_(std::move(loaded)),
        obs_(static_cast<size_t>(loaded_->policy->obs_size())),
        before_(obs_.size()),
        memory_(loaded_->policy->Start(1)),
        builder_(1, loaded_->memory(),
                 loaded_->identifies() ? std::optional(loaded_->plant) : std::nullopt) {}

  int64_t hz() const override { return kPolicyHz; }

  double Torque(int64_t step, const PendulumState& state) override {
    const Plant& plant = loaded_->plant;
    if (step == 0) {
      builder_.Begin(0, plant, state, obs_);
    } else {
      obs_.swap(before_);
      builder_.Next(0, plant, {state, torque_}, before_, torque_, obs_);
    }
    loaded_->policy->Act({obs_.data(), 1, loaded_->policy->obs_size()}, {&torque_, 1, 1}, *memory_);
    return torque_ = std::clamp(torque_, -plant.torque_limit, +plant.torque_limit);
  }

 private:
  std::shared_ptr<const LoadedPolicy> loaded_;
  std::vector<float> obs_, before_;
  double torque_ = 0;  // N·m
  std::unique_ptr<Policy::Memory> memory_;
  ObservationBuilder builder_;
};

/// The plant for which a controller of a twin's machine is designed, for this robot ("": the
/// twin's own).
Plant DesignPlant(const Twin& twin, const std::string& robot) {
  Plant plant = twin.plant;
  const auto usual = static_cast<Robot>(static_cast<int>(plant.actuated_joint));
  plant.actuated_joint = static_cast<int>(ParseRobot(robot).value_or(usual));
  plant.coulomb1 = plant.coulomb2 = 0;
  return plant;
}

/// Throws BadInput if a policy is for the other robot.
void ExpectRobot(const std::string& name, Robot own, Robot asked) {
  if (own == asked) return;
  throw BadInput(Concat("--robot: expected ", NameOf(own), ", the robot of ", Printable(name),
                        " (motor at joint ", static_cast<int>(own), "), got ", NameOf(asked)));
}

/// The text of a design plant; empty for the board's.
std::string DesignText(const Plant& plant) {
  Plant board = ReadPlantFile("realaigym").plant;
  board.actuated_joint = plant.actuated_joint;
  return PlantValues(plant) == PlantValues(board) ? "" : PlantText(plant);
}

}  // namespace

std::optional<Robot> ParseRobot(const std::string& name) {
  for (const Robot robot : {Robot::kPendubot, Robot::kAcrobot}) {
    if (name == NameOf(robot)) return robot;
  }
  if (name.empty()) return std::nullopt;
  throw BadInput(Concat("--robot: expected pendubot or acrobot, got \"", Printable(name), "\""));
}

Competitor GetCompetitor(PolicyArguments a, const std::string& robot,
                         const std::optional<Twin>& twin) {
  if (twin) a.plant = DesignPlant(*twin, robot);
  const auto loaded = std::make_shared<const LoadedPolicy>(GetPolicy(a));
  ExpectPendulum(*loaded);
  const auto own = static_cast<Robot>(static_cast<int>(loaded->plant.actuated_joint));
  ExpectRobot(loaded->name, own, ParseRobot(robot).value_or(own));
  return {loaded, own, DesignText(loaded->plant)};
}

std::unique_ptr<MachineController> MachineControllerOf(std::shared_ptr<const LoadedPolicy> loaded) {
  return std::make_unique<PolicyController>(std::move(loaded));
}

ControllerMaker ControllersOf(const Competitor& competitor) {
  return [loaded = competitor.loaded, motor = MotorOf(competitor.robot)]() -> CycleController {
    const auto loop = std::make_shared<LoopController>(MachineControllerOf(loaded), kBoardHz);
    return [loop, motor, begin = -1.0](const CycleInput& in) mutable -> Joints {
      if (begin < 0) begin = in.time;
      constexpr double kRounding = 1e-3;  // share of a step
      const auto step = static_cast<int64_t>((in.time - begin) / kBoardTimestep + kRounding);
      Joints torque{};
      torque[motor] = loop->Act(step, {in.angle[0], in.angle[1], in.velocity[0], in.velocity[1]});
      return torque;
    };
  };
}

MachineLog NominalLog(const Competitor& competitor) {
  return SimulateEpisode(competitor.robot, {}, ControllersOf(competitor)());
}

BoardReport ScoreOnBoard(const Competitor& competitor, uint64_t seed, ThreadPool& pool,
                         const Progress& progress) {
  BoardReport report{competitor, OutcomeOf(NominalLog(competitor)), {}};
  const ControllerMaker make = ControllersOf(competitor);
  const std::vector<RobustnessCase> cases = RobustnessCases(seed);
  std::vector<PendulumState> ends(cases.size());
  RunAll(static_cast<int>(cases.size()), &pool, progress, [&](int i) {
    const auto k = static_cast<size_t>(i);
    ends[k] = EndOf(competitor.robot, cases[k].episode, make());
  });
  report.robustness = JudgeRobustness(cases, ends);
  return report;
}

std::string BoardJson(const BoardReport& report) {
  const BoardOutcome& o = report.nominal;
  ordered_json j;
  j["policy"] = report.competitor.name();
  j["robot"] = NameOf(report.competitor.robot);
  j["performance"] = {{"score", PerformanceScore(o)},           {"swung_up", o.above_line},
                      {"swing_up_seconds", o.swing_up_seconds}, {"energy", o.energy},
                      {"torque_cost", o.torque_cost},           {"smoothness", o.smoothness},
                      {"velocity_cost", o.velocity_cost},       {"max_torque", o.max_torque},
                      {"penalties", PerformancePenalties(o)}};
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

MachineLog UptimeLog(const Competitor& competitor, uint64_t seed) {
  return SimulateEpisode(competitor.robot, {}, WithResets(ControllersOf(competitor), {}, seed),
                         kUptimeSeconds);
}

UptimeReport ScoreUptime(const Competitor& competitor, uint64_t seed, int count, ThreadPool& pool,
                         const Progress& progress) {
  UptimeReport report{competitor, std::vector<UptimeRun>(static_cast<size_t>(count))};
  RunAll(count, &pool, progress, [&](int i) {
    const auto k = static_cast<size_t>(i);
    report.runs[k] = UptimeOf(UptimeLog(competitor, seed + k));
  });
  return report;
}

std::string UptimeJson(const UptimeReport& report) {
  const Interval interval = report.interval();
  const auto [mean, deviation] = report.scores();
  ordered_json j{{"policy", report.competitor.name()},
                 {"robot", NameOf(report.competitor.robot)},
                 {"mean_score", mean},
                 {"interval", {interval.low, interval.high}},
                 {"deviation", deviation}};
  for (const UptimeRun& run : report.runs) {
    j["runs"].push_back({{"score", run.score}, {"swing_ups", run.swing_ups}});
  }
  return PrintableJson(j);
}

std::string BoardCsv(const MachineLog& log) {
  std::string csv = "time,pos_meas1,pos_meas2,vel_meas1,vel_meas2,tau_con1,tau_con2\n";
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
