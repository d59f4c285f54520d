// The TVLQR controllers that ran on RealAIGym's robot, rebuilt from their published settings and
// the logs of their runs: on machines of the twin they do what they did on the robot.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "extras/machine/twin/identify.h"
#include "extras/machine/twin/testing.h"
#include "extras/realaigym/machine_trials.h"

namespace upswing::realaigym {
namespace {

constexpr double kGridStep = 0.002;  // of the reference, s

// Published settings of the runs (experiments/design_C.1/tvlqr_*.py of the benchmark): friction
// compensation c atan(100 w) + d w, low-pass and dead zone of the velocities. The logs show limits
// of the law's torques before compensation; the motors limit the sum (TorqueLimits).
constexpr double kMotorLimit = 5, kPassiveLimit = 0.5;  // N·m
constexpr double kComp1 = 0.16, kComp2 = 0.12;          // N·m
constexpr double kCompDamping = 0.001;                  // N·m·s/rad
constexpr MachineSensors kFilter{.velocity_share = 0.2, .velocity_dead_zone = 0.1};
// The regulator takes over at the end of the reference within these angles and velocities. The real
// switch, an ellipsoid, needs the reference beyond the first switch, which the logs do not show.
constexpr double kCatchAngle = 0.35, kCatchVelocity = 3.5;  // rad, rad/s

Joints Compensation(const Joints& w) {
  return {DryFriction(kComp1, w[0]) + kCompDamping * w[0],
          DryFriction(kComp2, w[1]) + kCompDamping * w[1]};
}

/// The value matrix of the pendubot's regulator, as published.
Eigen::Matrix4d PendubotValue() {
  Eigen::Matrix4d S;
  S << 135.5276418268861, 113.1017639495109, 31.25315593082712, 19.8807650626410,  //
      113.1017639495109, 96.62495943248275, 26.26446629189177, 16.80197754529691,  //
      31.25315593082712, 26.26446629189177, 7.254724976398757, 4.615927732869536,  //
      19.8807650626410, 16.80197754529691, 4.615927732869536, 2.952912995717836;
  return S;
}

/// The model of the design: C.1 model 1.0 without friction.
Manipulator DesignModel() {
  BoardPlant plant;
  plant.rotor_inertia = 6.287203962819607e-05;
  return ManipulatorOf(plant);
}

Eigen::Vector4d Derivative(const Manipulator& m, const Eigen::Vector4d& x,
                           const Eigen::Vector2d& u) {
  const Joints a = m.Acceleration({x(0), x(1), x(2), x(3)}, {u(0), u(1)});
  return {x(2), x(3), a[0], a[1]};
}

/// A log's states (measured angles, filtered velocities) and torques without compensation.
struct Path {
  std::vector<Eigen::Vector4d> x;  // rad, rad/s
  std::vector<Eigen::Vector2d> u;  // N·m
};

Path PathOf(const MachineLog& log) {
  Path path;
  VelocityEstimate velocity(kFilter);
  for (int k = 0; k < log.rows(); ++k) {
    const Joints w = velocity.Update(log.time[k], log.angle[k]);
    const Joints friction = Compensation(w);
    path.x.emplace_back(log.angle[k][0], log.angle[k][1], w[0], w[1]);
    path.u.emplace_back(log.commanded[k][0] - friction[0], log.commanded[k][1] - friction[1]);
  }
  return path;
}

/// A time between two rows.
struct Place {
  size_t row;    // before the time
  double share;  // of the way to the next row
};

Place PlaceAt(const MachineLog& log, double time) {
  const auto after = std::ranges::upper_bound(log.time, time);
  if (after == log.time.begin()) return {0, 0};
  if (after == log.time.end()) return {log.time.size() - 2, 1};
  const auto row = static_cast<size_t>(after - log.time.begin()) - 1;
  return {row, (time - log.time[row]) / (log.time[row + 1] - log.time[row])};
}

/// Whether the regulator can take over in a state.
bool IsNearUpright(const Eigen::Vector4d& x) {
  return std::abs(Wrapped(x(0) - std::numbers::pi)) < kCatchAngle &&
         std::abs(Wrapped(x(1))) < kCatchAngle && std::abs(x(2)) < kCatchVelocity &&
         std::abs(x(3)) < kCatchVelocity;
}

/// The law u = ū(t) - K(t) (x - x̄(t)) with friction compensation, then a constant regulator about
/// upright. To first order, any path near the reference gives the same law: ū and x̄ are means over
/// runs, and K follows from the published costs by Riccati's equation along them.
class RebuiltTvlqr {
 public:
  /// Throws BadInput unless the logs are runs of this robot without pushes that stay upright.
  RebuiltTvlqr(std::span<const MachineLog> logs, Robot robot);

  /// The rms difference (N·m) between a log's commanded torques at the motor's joint and this law
  /// before the regulator takes over: how well the law is rebuilt.
  double Misfit(const MachineLog& log) const;

  /// Makes controllers for trials on a twin. The law must outlive them.
  TrialController OnMachine() const;

 private:
  using State = Eigen::Vector4d;
  using Gain = Eigen::Matrix<double, 2, 4>;

  /// The torques within the law's limits, to which friction compensation is added. `upright`:
  /// whether the regulator holds.
  Eigen::Vector2d Torque(double time, const State& x, bool upright) const;
  bool Catches(double time, const State& x) const;
  void Linearise();

  Robot robot_;
  std::vector<State> x_;            // x̄, (rad, rad, rad/s, rad/s)
  std::vector<Eigen::Vector2d> u_;  // ū, N·m
  std::vector<Gain> K_;             // at each point of the reference
  Gain regulator_;                  // gain about upright
};

RebuiltTvlqr::RebuiltTvlqr(std::span<const MachineLog> logs, Robot robot) : robot_(robot) {
  double end = 1e9;
  std::vector<Path> paths;
  for (const MachineLog& log : logs) {
    if (log.commanded.empty() || !log.push.empty()) {
      throw BadInput(Concat(Printable(log.name),
                            ": expected a run with commanded torques and without pushes"));
    }
    paths.push_back(PathOf(log));
    const auto caught = std::ranges::find_if(paths.back().x, IsNearUpright);
    if (caught == paths.back().x.end()) continue;
    end = std::min(end, log.time[static_cast<size_t>(caught - paths.back().x.begin())]);
  }
  if (end == 1e9) throw BadInput("--law: expected a run that reaches upright, got none");
  if (end < kGridStep) throw BadInput("--law: expected runs that begin away from upright");
  // All runs follow the same law until the first one is caught.
  for (double time = 0; time < end; time += kGridStep) {
    Eigen::Vector4d x = Eigen::Vector4d::Zero();
    Eigen::Vector2d u = Eigen::Vector2d::Zero();
    for (size_t i = 0; i < logs.size(); ++i) {
      const auto [row, share] = PlaceAt(logs[i], time);
      const auto& [xs, us] = paths[i];
      x += (xs[row] + share * (xs[row + 1] - xs[row])) / static_cast<double>(logs.size());
      u += (us[row] + share * (us[row + 1] - us[row])) / static_cast<double>(logs.size());
    }
    x_.push_back(x);
    u_.push_back(u);
  }
  Linearise();
}

void RebuiltTvlqr::Linearise() {
  const Manipulator model = DesignModel();
  const bool pendubot = robot_ == Robot::kPendubot;
  Eigen::Matrix4d Q = Eigen::Matrix4d::Identity(), S;
  Eigen::Matrix2d R = Eigen::Matrix2d::Identity();
  if (pendubot) {
    S = PendubotValue();  // the final cost
  } else {
    Q = Eigen::Vector4d(0.64, 0.56, 0.13, 0.067).asDiagonal();
    R *= 0.82;
    S = Q;
  }
  K_.assign(x_.size(), Gain::Zero());
  for (size_t k = x_.size(); k-- > 0;) {
    Eigen::Matrix4d A;
    for (int i = 0; i < 4; ++i) {
      Eigen::Vector4d d = Eigen::Vector4d::Zero();
      d(i) = 1e-6;
      A.col(i) = (Derivative(model, x_[k] + d, u_[k]) - Derivative(model, x_[k] - d, u_[k])) / 2e-6;
    }
    Eigen::Matrix<double, 4, 2> B = Eigen::Matrix<double, 4, 2>::Zero();
    const MassMatrix M = model.Mass(std::cos(x_[k](1)));
    B.bottomRows<2>() << M.M22, -M.M12, -M.M12, M.M11;
    B /= M.det;
    if (pendubot) B.col(1).setZero();
    const Eigen::Matrix4d Ad =
        Eigen::Matrix4d::Identity() + A * kGridStep + A * A * (kGridStep * kGridStep / 2);
    const Eigen::Matrix<double, 4, 2> Bd = B * kGridStep + A * B * (kGridStep * kGridStep / 2);
    const Eigen::Matrix2d G = R * kGridStep + Bd.transpose() * S * Bd;
    K_[k] = G.inverse() * Bd.transpose() * S * Ad;
    S = Q * kGridStep + Ad.transpose() * S * (Ad - Bd * K_[k]);
  }
  // The regulators' costs are not published for both robots. These gains explain the logged
  // commands of all runs near upright to 1e-4 N·m.
  if (pendubot) {
    regulator_ << -37.458, -36.587, -8.752, -6.430, 0, 0, 0, 0;
  } else {
    regulator_ << 8.852, 2.711, 2.630, 0.495, 2.352, 5.044, 0.248, 1.755;
  }
}

Eigen::Vector2d RebuiltTvlqr::Torque(double time, const State& x, bool upright) const {
  Eigen::Vector2d limit(kPassiveLimit, kPassiveLimit);
  limit(static_cast<int>(robot_) - 1) = kMotorLimit;
  const auto limited = [&](const Eigen::Vector2d& u) -> Eigen::Vector2d {
    return u.cwiseMin(limit).cwiseMax(-limit);
  };
  if (upright) {
    return limited(-regulator_ *
                   State(Wrapped(x(0) - std::numbers::pi), Wrapped(x(1)), x(2), x(3)));
  }
  const double place = std::clamp(time / kGridStep, 0.0, static_cast<double>(x_.size()) - 1 - 1e-9);
  const auto k = static_cast<size_t>(place);
  const double share = place - static_cast<double>(k);
  const State reference = x_[k] + share * (x_[k + 1] - x_[k]);
  return limited(u_[k] + share * (u_[k + 1] - u_[k]) - K_[k] * (x - reference));
}

bool RebuiltTvlqr::Catches(double time, const State& x) const {
  return time >= kGridStep * static_cast<double>(x_.size()) && IsNearUpright(x);
}

double RebuiltTvlqr::Misfit(const MachineLog& log) const {
  const Path path = PathOf(log);
  const int j = static_cast<int>(robot_) - 1;
  constexpr double kBeforeSwitch = 0.5;  // s: the runs switch at different times
  double sum = 0;
  int rows = 0;
  for (int k = 0; k < log.rows(); ++k) {
    if (log.time[k] > kGridStep * static_cast<double>(x_.size()) - kBeforeSwitch) break;
    const auto row = static_cast<size_t>(k);
    const double error = Torque(log.time[k], path.x[row], false)(j) - path.u[row](j);
    sum += error * error;
    ++rows;
  }
  return std::sqrt(sum / std::max(rows, 1));
}

TrialController RebuiltTvlqr::OnMachine() const {
  return [this](uint64_t /*seed*/) -> CycleController {
    return [this, upright = false](const CycleInput& in) mutable -> Joints {
      const State x(in.angle[0], in.angle[1], in.velocity[0], in.velocity[1]);
      upright = upright || Catches(in.time, x);  // the regulator keeps control
      const Eigen::Vector2d u = Torque(in.time, x, upright);
      const Joints friction = Compensation(in.velocity);
      return {u(0) + friction[0], u(1) + friction[1]};
    };
  };
}

/// Runs like real ones (not empty) on machines drawn from the twin's posterior: in their session,
/// with their loop's timing, and with their pushes in turn.
HardwareReport RunTvlqrTrials(const Twin& twin, Robot robot, const RebuiltTvlqr& law,
                              std::span<const MachineLog> runs, const TrialRules& rules) {
  Twin machine = InSession(twin, runs.front());
  MeasureLoop(runs, machine);
  machine.sensors.velocity_share = kFilter.velocity_share;
  machine.sensors.velocity_dead_zone = kFilter.velocity_dead_zone;
  TrialRules own = rules;
  own.pushes = !runs.front().push.empty();
  if (own.pushes) {
    own.push_of = [runs](int trial) -> std::function<Joints(double)> {
      const MachineLog& log = runs[static_cast<size_t>(trial) % runs.size()];
      return [&log](double time) { return log.push[PlaceAt(log, time).row]; };
    };
  }
  ThreadPool pool(2);
  return RunTrials(machine, robot, law.OnMachine(), own, &pool);
}

/// The five given runs of a robot's TVLQR, in a folder of the measured data.
std::vector<MachineLog> TvlqrRuns(Robot robot, const char* folder) {
  std::vector<MachineLog> logs;
  for (int run = 1; run <= 5; ++run) {
    const std::string name = Concat(NameOf(robot), "-tvlqr-0", run, ".csv.gz");
    logs.push_back(ReadLog(RealData() / "C.1" / folder / name).front());
  }
  return logs;
}

/// A twin of the robot: the shipped one, or the file in UPSWING_TWIN.
Twin TwinOfRobot() {
  const char* file = std::getenv("UPSWING_TWIN");
  return ReadTwin(file != nullptr ? file : "realaigym-twin", "test");
}

/// Machines of the twin for each real run: few, or 200 for the tables of docs/results/machine.md.
int MachinesOfARun() { return std::getenv("UPSWING_RUNS") != nullptr ? 200 : 4; }

/// Runs of 10 s on machines of the twin, like the real runs in a folder.
HardwareReport OnTwin(Robot robot, const std::vector<MachineLog>& real) {
  const RebuiltTvlqr law(TvlqrRuns(robot, "swingup"), robot);
  const TrialRules rules{.count = 5 * MachinesOfARun()};
  HardwareReport report = RunTvlqrTrials(TwinOfRobot(), robot, law, real, rules);
  std::printf("%s%s: %d of %d machines succeed, mean score %.3f\n", NameOf(robot),
              report.pushed ? ", pushed" : "", report.successes(), rules.count, report.mean());
  return report;
}

/// The published controller swings the acrobot up on the twin as on the machine.
TEST(ClosedLoop, SwingsUpTheTwinLikeTheMachine) {
  if (RealData().empty()) GTEST_SKIP() << "no measured data";
  const std::vector<MachineLog> logs = TvlqrRuns(Robot::kAcrobot, "swingup");
  const RebuiltTvlqr law(logs, Robot::kAcrobot);
  for (const MachineLog& log : logs) EXPECT_LT(law.Misfit(log), 0.05) << log.name;
  const HardwareReport acrobot = OnTwin(Robot::kAcrobot, logs);
  EXPECT_GE(acrobot.successes(), 4.25 * MachinesOfARun());
  EXPECT_NEAR(acrobot.mean(), 0.587, 0.08);  // the published mean of ten real runs
}

/// Prints for docs/results/machine.md what else the twin does with the pushes of each real run.
/// Under pushes the controller fails more often, as on the machine.
TEST(ClosedLoop, FailsMoreOftenUnderThePushesOfTheRealRuns) {
  if (RealData().empty()) GTEST_SKIP() << "no measured data";
  for (const Robot robot : {Robot::kAcrobot, Robot::kPendubot}) {
    const int without = OnTwin(robot, TvlqrRuns(robot, "swingup")).successes();
    const HardwareReport pushed = OnTwin(robot, TvlqrRuns(robot, "pushed"));
    EXPECT_LE(pushed.successes(), without);
    for (size_t k = 0; k < 5; ++k) {
      int successes = 0;
      for (size_t i = k; i < pushed.runs.size(); i += 5) {
        successes += pushed.runs[i].outcome.above_line ? 1 : 0;
      }
      std::printf("  pushes of run %zu: %d of %d machines succeed\n", k + 1, successes,
                  MachinesOfARun());
    }
  }
}

}  // namespace
}  // namespace upswing::realaigym
