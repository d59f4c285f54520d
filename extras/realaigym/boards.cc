#include "extras/realaigym/boards.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "agents/controllers.h"
#include "base/error.h"
#include "base/json.h"
#include "base/sample.h"
#include "base/stopwatch.h"
#include "base/text.h"
#include "pendulum/observation.h"
#include "report/figure.h"
#include "runs/find_policy.h"
#include "runs/plant_file.h"
#include "runs/tensor_file.h"

namespace upswing::realaigym {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Controller made by ControllerOf.
class PolicyController : public BoardController {
 public:
  PolicyController(const LoadedPolicy& loaded, size_t count)
      : loaded_(loaded),
        size_(static_cast<size_t>(loaded.policy->obs_size())),
        obs_(count * size_),
        before_(size_),
        action_(count),
        memory_(loaded.policy->Start(static_cast<int>(count))),
        builder_(static_cast<int>(count), loaded.memory(),
                 loaded.identifies() ? std::optional(loaded.plant) : std::nullopt) {}

  void Act(int step, const BoardMeasurement& measured, size_t count, Lanes& torque) override {
    if (step % kPolicyPeriod != 0) return;
    for (size_t lane = 0; lane < count; ++lane) Observe(step, measured, lane);
    const int rows = static_cast<int>(count);
    loaded_.policy->Act({obs_.data(), rows, loaded_.policy->obs_size()}, {action_.data(), rows, 1},
                        *memory_);
    const double limit = loaded_.plant.torque_limit;
    for (size_t lane = 0; lane < count; ++lane) {
      torque[lane] = action_[lane] = std::clamp(action_[lane], -limit, limit);
    }
  }

 private:
  void Observe(int step, const BoardMeasurement& m, size_t lane) {
    const int env = static_cast<int>(lane);
    const auto row = std::span(obs_).subspan(lane * size_, size_);
    const PendulumState measured{m.q1[lane], m.q2[lane], m.w1[lane], m.w2[lane]};
    if (step == 0) return builder_.Begin(env, loaded_.plant, measured, row);
    std::ranges::copy(row, before_.begin());
    builder_.Next(env, loaded_.plant, {measured, action_[lane]}, before_, action_[lane], row);
  }

  const LoadedPolicy& loaded_;
  size_t size_;
  std::vector<float> obs_, before_;
  std::vector<double> action_;
  std::unique_ptr<Policy::Memory> memory_;
  ObservationBuilder builder_;
};

/// Controller made by MachineControllerOf: the first lane of a block.
class OfOneMachine : public MachineController {
 public:
  explicit OfOneMachine(const Competitor& competitor)
      : period_(competitor.period), controller_(competitor.make(0)) {
    // A first call touches memory that is not there yet; a second controller takes it.
    competitor.make(0)->Act(0, measured_, 1, torque_);
    torque_ = {};
  }

  int64_t hz() const override { return kBoardHz / period_; }

  double Torque(int64_t step, const PendulumState& state, bool estimated) override {
    measured_.SetFirst(state, estimated);
    controller_->Act(static_cast<int>(step) * period_, measured_, 1, torque_);
    return torque_[0];
  }

 private:
  static constexpr int64_t kBoardHz = 500;
  static_assert(kBoardTimestep * kBoardHz == 1);

  int period_;
  std::unique_ptr<BoardController> controller_;
  BoardMeasurement measured_{};
  Lanes torque_{};
};

/// The benchmark's own regulator of the linear model, with the weights of its baselines.
class RegulatorController : public BoardController {
 public:
  explicit RegulatorController(Robot robot)
      : K_(SolveBoardLqr(robot, {0.97, 0.93, 0.39, 0.26}, 0.11).K) {}

  void Act(int /*step*/, const BoardMeasurement& m, size_t count, Lanes& torque) override {
    for (size_t lane = 0; lane < count; ++lane) {
      const auto [e1, e2] = Lean({m.q1[lane], m.q2[lane], 0, 0});
      // Lean gives the absolute angle of link 2.
      const double q2 = Wrapped(e2 - e1);
      torque[lane] = -(K_[0] * e1 + K_[1] * q2 + K_[2] * m.w1[lane] + K_[3] * m.w2[lane]);
    }
  }

 private:
  Eigen::RowVector4d K_;
};

Robot ParseRobot(const std::string& name, Robot usual) {
  if (name.empty()) return usual;
  if (const auto robot = RobotNamed(name)) return *robot;
  throw BadInput(Concat("--robot: expected pendubot or acrobot, got \"", Printable(name), "\""));
}

/// The plant for which a controller of a twin's machine is designed, for this robot ("": the
/// twin's own).
Plant DesignPlant(const Twin& twin, const std::string& robot) {
  Plant plant = twin.plant;
  const auto usual = static_cast<Robot>(static_cast<int>(plant.actuated_joint));
  plant.actuated_joint = static_cast<int>(ParseRobot(robot, usual));
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

Competitor OfSearch(const std::string& name, SwingPolicy policy) {
  const auto kept = std::make_shared<SwingPolicy>(std::move(policy));
  return {name, kept->net.robot(), [kept](size_t) { return kept->net.Control(kept->numbers); }};
}

}  // namespace

SwingPolicy LoadSwingPolicy(const fs::path& path) {
  const Tensors tensors = LoadTensors(path, kMostPolicyBytes);
  if (!IsSwingPolicy(tensors)) {
    throw BadInput(Concat(Printable(path.string()), ": expected a policy of `realaigym --search`"));
  }
  return ReadSwingPolicy(tensors);
}

Competitor CompetitorOf(const BoardSearch& search, const std::string& name) {
  return OfSearch(name, {search.net(), search.numbers()});
}

std::unique_ptr<BoardController> ControllerOf(const LoadedPolicy& loaded, size_t count) {
  return std::make_unique<PolicyController>(loaded, count);
}

std::unique_ptr<MachineController> MachineControllerOf(const Competitor& competitor) {
  return std::make_unique<OfOneMachine>(competitor);
}

Competitor GetCompetitor(PolicyArguments a, const std::string& robot,
                         const std::optional<Twin>& twin) {
  if (twin) a.plant = DesignPlant(*twin, robot);
  if (a.name == kBoardRegulator && !a.has_settings() && !fs::exists(a.name)) {
    const Robot asked = ParseRobot(robot, Robot::kPendubot);
    return {kBoardRegulator, asked,
            [asked](size_t) { return std::make_unique<RegulatorController>(asked); }};
  }
  if (!IsController(a.name) && fs::is_regular_file(a.name)) {
    const Tensors tensors = LoadTensors(a.name, kMostPolicyBytes);
    if (IsSwingPolicy(tensors)) {
      Competitor found = OfSearch(a.name, ReadSwingPolicy(tensors));
      ExpectRobot(a.name, found.robot, ParseRobot(robot, found.robot));
      return found;
    }
  }
  const auto loaded = std::make_shared<const LoadedPolicy>(GetPolicy(a));
  ExpectPendulum(*loaded);
  const auto own = static_cast<Robot>(static_cast<int>(loaded->plant.actuated_joint));
  ExpectRobot(loaded->name, own, ParseRobot(robot, own));
  return {loaded->name, own, [loaded](size_t) { return ControllerOf(*loaded, kBoardBlock); },
          DesignText(loaded->plant), kPolicyPeriod};
}

std::vector<BoardEntry> PublishedEntries(Robot robot) {
  if (robot == Robot::kAcrobot) {
    const auto scores = [](const char* name, double performance, double robustness) {
      BoardEntry entry{name,     kUnknown,    kUnknown, kUnknown,  kUnknown,
                       kUnknown, performance, {},       robustness};
      entry.rows.fill(kUnknown);
      return entry;
    };
    return {scores("History SAC", .655, .751), scores("AR-EAPO", .633, .727),
            scores("TVLQR", .504, .607)};
  }
  return {
      {"History SAC", 1.15, 7.67, 2.36, .007, 62.07, .682, {.681, .476, 1, 1, 1, .46}, .770},
      {"AR-EAPO", 1.15, 7.72, 2.43, .010, 64.33, .659, {.876, .81, 1, 1, .81, .98}, .913},
      {"EvolSAC", .71, 9.83, 4.37, .014, 58.15, .596, {.752, .571, 1, 1, .714, .68}, .786},
      {"iLQR Riccati",
       4.13,
       9.53,
       1.25,
       .005,
       211.34,
       .536,
       {.052, .381, .095, .857, .143, 0},
       .255},
      {"TVLQR", 4.13, 9.53, 1.26, .007, 211.12, .526, {.629, .905, 1, 1, .429, .64}, .767},
      {"MC-PILCO+LQR",
       1.14,
       8.35,
       2.42,
       .054,
       114.26,
       .480,
       {.248, .762, .619, .952, .286, .82},
       .614},
      {"iLQR MPC stab.", 4.12, 9.91, 1.77, .083, 211.98, .353, {.319, .905, 1, 1, .381, .44}, .674},
  };
}

std::vector<UptimeEntry> PublishedUptimes(Robot robot) {
  if (robot == Robot::kAcrobot) {
    return {{"AR-EAPO", .658, 21},
            {"VIMPPI", .648, 16},
            {"acados MPC", .630, 21},
            {"MC-PILCO", .307, 34},
            {"PRX analytical", .117, 14}};
  }
  return {{"VIMPPI", .799, 16},
          {"AR-EAPO", .759, 16},
          {"acados MPC", .726, 16},
          {"MC-PILCO", .509, 23},
          {"PRX analytical", .240, 13}};
}

std::vector<HardwareEntry> PublishedHardwareEntries(Robot robot, bool pushed) {
  if (robot == Robot::kAcrobot && pushed) {
    // The runs at IROS 2024 were scored with the normalisers of runs without pushes.
    return {{"TVLQR", 5, 4.05, 14.66, 3.82, .079, 110.92, .462, .22}};
  }
  if (robot == Robot::kAcrobot) {
    return {{"TVLQR", 10, 4.03, 13.72, 3.43, .075, 109.7, .592, .587},
            {"MC-PILCO", 10, 1.55, 17.95, 11.73, .671, 118.38, .492, .484}};
  }
  if (pushed) {
    return {{"AR-EAPO (IROS 2024)", 10, .77, 11.7, 7.33, .237, 49.53, .711, .646},
            {"MC-PILCO (IROS 2024)", 10, .73, 10.22, 9.92, .475, 36.84, .691, .644},
            {"History SAC (IROS 2024)", 7, 5.73, 13.98, 5.08, .197, 141.48, .509, .343},
            // One of the three runs stopped at 4.32 s. Without it the mean is lower.
            {"TVLQR", 3, 4.12, 29.24, 20.0, .375, 249.44, .343, .097},
            {"EvolSAC (IROS 2024)", 2, 5.02, 23.16, 18.59, .346, 243.33, .351, .068}};
  }
  return {{"MC-PILCO", 10, 1.37, 11.66, 8.93, .54, 84.61, .598, .591},
          {"TVLQR", 8, 4.12, 34.02, 51.88, .643, 242.34, .227, .175},
          {"SAC+LQR", 4, .67, 37.12, 78.7, .774, 114.04, .338, .124}};
}

BoardEntry BoardReport::Entry() const {
  return {competitor.name,           nominal.swing_up_seconds, nominal.energy,
          nominal.torque_cost,       nominal.smoothness,       nominal.velocity_cost,
          PerformanceScore(nominal), robustness.rows,          robustness.score()};
}

BoardReport ScoreOnBoard(const Competitor& competitor, uint64_t seed, ThreadPool& pool,
                         const Progress& progress) {
  const Stopwatch watch;
  BoardReport report{competitor, {}, {}, {}, 0};
  const std::array<BoardEpisode, 1> nominal;
  report.nominal =
      SimulateOnBoard(competitor.robot, nominal, competitor.make, nullptr, &report.trace).front();
  const std::vector<RobustnessCase> cases = RobustnessCases(seed);
  std::vector<BoardEpisode> episodes;
  episodes.reserve(cases.size());
  for (const RobustnessCase& each : cases) episodes.push_back(each.episode);
  report.robustness = JudgeRobustness(
      cases,
      SimulateOnBoard(competitor.robot, episodes, competitor.make, &pool, nullptr, progress));
  report.seconds = watch.seconds();
  return report;
}

UptimeReport ScoreUptime(const Competitor& competitor, uint64_t seed, int count, ThreadPool& pool,
                         const Progress& progress) {
  const Stopwatch watch;
  UptimeReport report{competitor, {}, {}, {}, 0};
  report.runs = SimulateUptimes(
      competitor.robot, [&] { return MachineControllerOf(competitor); }, seed, count, &pool,
      &report.trace, progress);
  std::vector<double> scores;
  for (const UptimeRun& run : report.runs) scores.push_back(run.score);
  report.scores = MomentsOf(scores);
  report.seconds = watch.seconds();
  return report;
}

Interval UptimeReport::interval() const {
  const double half = 1.96 * scores.deviation / std::sqrt(static_cast<double>(runs.size()));
  return {scores.mean - half, scores.mean + half};
}

std::string UptimeJson(const UptimeReport& report) {
  const Interval interval = report.interval();
  ordered_json j{{"policy", report.competitor.name},
                 {"robot", NameOf(report.competitor.robot)},
                 {"mean_score", report.scores.mean},
                 {"interval", {interval.low, interval.high}},
                 {"deviation", report.scores.deviation}};
  for (const UptimeRun& run : report.runs) {
    j["runs"].push_back({{"score", run.score}, {"swing_ups", run.swing_ups}});
  }
  j["seconds"] = report.seconds;
  return PrintableJson(j);
}

std::string BoardJson(const BoardReport& report) {
  const BoardOutcome& o = report.nominal;
  ordered_json j;
  j["policy"] = report.competitor.name;
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
  j["seconds"] = report.seconds;
  return PrintableJson(j);
}

std::string BoardCsv(std::span<const BoardSample> trace) {
  std::string csv = "time,pos_meas1,pos_meas2,vel_meas1,vel_meas2,tau_con1,tau_con2\n";
  for (const BoardSample& sample : trace) {
    csv += FormatNumber(std::round(sample.time * 1e6) / 1e6);
    for (const double x : sample.state) csv += Concat(",", FormatNumber(x));
    for (const double u : sample.torque) csv += Concat(",", FormatNumber(u));
    csv += '\n';
  }
  return csv;
}

void DrawBoard(const BoardReport& report, const fs::path& file) {
  Figure figure;
  figure.title = Concat(Printable(report.competitor.name), " on RealAIGym's ",
                        NameOf(report.competitor.robot));
  figure.caption = fmt::format(
      "simulation, version 2: performance {:.3f}, robustness {:.3f}. Shares of simulations that "
      "end "
      "upright; a level passes above one half",
      PerformanceScore(report.nominal), report.robustness.score());
  figure.columns = 3;
  figure.width = 1200;
  figure.height = 720;
  const auto title = [&](size_t row) {
    return fmt::format("{}: {:.1f}%", kRobustnessRowNames.at(row),
                       100 * report.robustness.rows.at(row));
  };
  Panel model;
  model.x_label = "level of the error";
  model.y_label = "Ir, m1r1, I1, m2r2, m2, I2, b1, b2, cf1, cf2";
  model.heat_map.emplace();
  model.heat_map->label = "ends upright";
  model.heat_map->high = 1;
  for (int i = 1; i <= kBoardLevels; ++i) model.heat_map->x.push_back(i);
  const size_t parameters = kBoardVariations.size();
  for (size_t k = 0; k < parameters; ++k) {
    model.heat_map->y.push_back(static_cast<double>(k + 1));
    const auto& share = report.robustness.curves[k].share;
    model.heat_map->z.insert(model.heat_map->z.end(), share.begin(), share.end());
  }
  model.title = title(0);
  figure.panels.push_back(std::move(model));
  constexpr const char* kLabels[] = {"noise of the velocities (rad/s)", "noise of the torque (N·m)",
                                     "response k", "delay (s)"};
  for (size_t row = 1; row + 1 < kRobustnessRows; ++row) {
    const RobustnessCurve& curve = report.robustness.curves[parameters + row - 1];
    Panel panel;
    panel.title = title(row);
    panel.x_label = kLabels[row - 1];
    panel.y_label = "share that ends upright";
    panel.lines = {{"", curve.values, curve.share, {}, {}, true}};
    panel.y_range = {-0.05, 1.05};
    figure.panels.push_back(std::move(panel));
  }
  const double share = report.robustness.rows.back();
  Panel pushes;
  pushes.title = title(kRobustnessRows - 1);
  pushes.x_label = "50 profiles of pushes";
  pushes.y_label = "share that ends upright";
  pushes.lines = {{"", {0, kBoardPushCases}, {share, share}, {}, {}}};
  pushes.y_range = {-0.05, 1.05};
  figure.panels.push_back(std::move(pushes));
  Draw(figure, file);
}

}  // namespace upswing::realaigym
