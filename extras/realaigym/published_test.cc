// Rebuilds a published entry of the board from its own trajectory, and scores it by our rules.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <vector>

#include "base/csv.h"
#include "base/thread_pool.h"
#include "control/linearize.h"
#include "control/testing.h"
#include "extras/realaigym/hardware.h"
#include "extras/realaigym/simulation.h"

namespace upswing::realaigym {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSpacing = 0.001;  // spacing of the samples that the entry fits its cubics to, s
constexpr int kFileSpacing = 10;    // samples per row of the file
constexpr int kPiece = 150;         // samples per cubic

/// Samples every kSpacing, interpolated by the cubic through the file's nearest four rows.
std::vector<double> Refined(const std::vector<double>& rows) {
  std::vector<double> samples;
  for (size_t i = 0; i < kFileSpacing * rows.size(); ++i) {
    const double place = static_cast<double>(i) / kFileSpacing;
    const size_t first = std::clamp<size_t>(i / kFileSpacing, 1, rows.size() - 3) - 1;
    const double x = place - static_cast<double>(first);
    const double* y = &rows[first];
    samples.push_back(-(x - 1) * (x - 2) * (x - 3) / 6 * y[0] + x * (x - 2) * (x - 3) / 2 * y[1] -
                      x * (x - 1) * (x - 3) / 2 * y[2] + x * (x - 1) * (x - 2) / 6 * y[3]);
  }
  return samples;
}

/// A quantity over time as the entry stores it: one fitted cubic per piece of samples.
class Cubics {
 public:
  /// Fits the whole pieces of the samples.
  explicit Cubics(const std::vector<double>& samples) {
    EXPECT_EQ(samples.size() % kPiece, 0);
    // The normal equations: the powers are those of numbers below 1, so that few digits are lost.
    Eigen::Matrix4d gram = Eigen::Matrix4d::Zero();
    for (int i = 0; i < kPiece; ++i) gram += Powers(i).transpose() * Powers(i);
    const Eigen::Matrix4d inverse = gram.inverse();
    for (size_t first = 0; first + kPiece <= samples.size(); first += kPiece) {
      Eigen::RowVector4d moments = Eigen::RowVector4d::Zero();
      for (size_t i = 0; i < kPiece; ++i) {
        moments += samples[first + i] * Powers(static_cast<double>(i));
      }
      pieces_.emplace_back(inverse * moments.transpose());
    }
  }

  size_t samples() const { return kPiece * pieces_.size(); }

  double At(double t) const {
    const double i = std::min(t / kSpacing, static_cast<double>(samples() - 1));
    const auto piece = static_cast<size_t>(i / kPiece + 1e-9);
    return Powers(i - static_cast<double>(kPiece * piece)) * pieces_[piece];
  }

 private:
  static Eigen::RowVector4d Powers(double i) {
    const double x = i / kPiece;
    return {1, x, x * x, x * x * x};
  }

  std::vector<Eigen::Vector4d> pieces_;
};

/// q̈ of the board's plant, rad/s².
Eigen::Vector2d Acceleration(const Eigen::Vector4d& x, double torque) {
  const auto a = ManipulatorOf(BoardPlant()).Acceleration({x[0], x[1], x[2], x[3]}, {torque, 0});
  return {a[0], a[1]};
}

/// The entry's swing-up: two angles (rad), two velocities (rad/s), the torque (N·m).
std::vector<Cubics> ReadTrajectory() {
  const auto path =
      std::filesystem::path(__FILE__).parent_path() / "testdata/pendubot_tvlqr_trajectory.csv";
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  std::vector<Cubics> trajectory;
  for (const CsvColumn& column :
       ReadCsv(text, {"pos1", "pos2", "vel1", "vel2", "tau1"}, path.string())) {
    trajectory.emplace_back(Refined(column.values));
  }
  return trajectory;
}

Eigen::Vector4d FirstFourAt(const std::vector<Cubics>& channels, double t) {
  return {channels[0].At(t), channels[1].At(t), channels[2].At(t), channels[3].At(t)};
}

/// TVLQR, an entry of the pendubot's boards. It follows a swing-up with a time-varying regulator,
/// and once near upright holds it with another for good. Its parameters come from the repository
/// that the trajectory's file names: leaderboard/pendubot/simulation_v2/con_ilqr_tvlqr_lqr.py and
/// its classes (tvlqr_controller.py, pcw_polynomial.py).
class PublishedTvlqr {
 public:
  /// Precomputed trajectory and gains.
  struct Plan {
    Plan();
    std::vector<Cubics> trajectory;  // of ReadTrajectory
    std::vector<Cubics> K;           // (4), N·m/rad and N·m·s/rad
    Lqr upright;
  };

  explicit PublishedTvlqr(const Plan& plan) : plan_(&plan) {}

  Joints operator()(const CycleInput& in) {
    const Eigen::Vector4d then = FirstFourAt(plan_->trajectory, in.time);
    const Eigen::Vector4d K = FirstFourAt(plan_->K, in.time);
    const Eigen::Vector4d x(in.angle[0], in.angle[1], in.velocity[0], in.velocity[1]);
    const Eigen::Vector4d off = Wrapped(x - Eigen::Vector4d(kPi, 0, 0, 0));
    held_ = held_ || (std::abs(off[0]) <= 0.05 && std::abs(off[1]) <= 0.05 &&
                      std::abs(off[2]) <= 0.1 && std::abs(off[3]) <= 0.1);
    const auto& [gain, cost] = plan_->upright;
    if (!held_) return {plan_->trajectory[4].At(in.time) - K.dot(Wrapped(x - then)), 0};
    return {off.dot(cost * off) > 1000 ? 0 : -gain.dot(off), 0};
  }

 private:
  static Eigen::Vector4d Wrapped(Eigen::Vector4d x) {
    x[0] = std::remainder(x[0], 2 * kPi);
    x[1] = std::remainder(x[1], 2 * kPi);
    return x;
  }

  const Plan* plan_;
  bool held_ = false;
};

/// The regulator of the benchmark's baselines.
Lqr BaselineLqr() {
  return ContinuousLqr(LinearizeUpright(ManipulatorOf(BoardPlant()), 1),
                       Eigen::Vector4d(0.97, 0.93, 0.39, 0.26).asDiagonal(), 0.11);
}

PublishedTvlqr::Plan::Plan() : trajectory(ReadTrajectory()), upright(BaselineLqr()) {
  const Eigen::Matrix4d Q = Eigen::Vector4d(0.64, 0.56, 0.13, 0.037).asDiagonal();
  constexpr double kR = 0.82;
  std::array<std::vector<double>, 4> gains;
  for (auto& each : gains) each.resize(trajectory.front().samples());  // the last gain is 0
  Eigen::Matrix4d P = upright.P;
  for (size_t i = gains[0].size() - 1; i-- > 0;) {
    const double t = static_cast<double>(i) * kSpacing;
    const Eigen::Vector4d x = FirstFourAt(trajectory, t);
    const double u = trajectory[4].At(t);
    // Euler step of the model linearised here.
    Eigen::Matrix4d A = Eigen::Matrix4d::Identity();
    A.topRightCorner<2, 2>() += kSpacing * Eigen::Matrix2d::Identity();
    constexpr double kStep = 1e-5;
    for (int j = 0; j < 4; ++j) {
      const Eigen::Vector4d d = kStep * Eigen::Vector4d::Unit(j);
      A.block<2, 1>(2, j) +=
          kSpacing * (Acceleration(x + d, u) - Acceleration(x - d, u)) / (2 * kStep);
    }
    Eigen::Vector4d B = Eigen::Vector4d::Zero();
    B.tail<2>() = kSpacing * (Acceleration(x, 1) - Acceleration(x, 0));
    const Eigen::RowVector4d gain = B.transpose() * P * A / (kR + B.dot(P * B));
    P = (Q + A.transpose() * P * (A - B * gain)).eval();
    for (int j = 0; j < 4; ++j) gains[static_cast<size_t>(j)][i] = gain[j];
  }
  for (const auto& each : gains) K.emplace_back(each);
}

TEST(RealAiGymPublished, TvlqrHasItsPublishedScores) {
  const PublishedTvlqr::Plan plan;
  const BoardOutcome o = OutcomeOf(SimulateEpisode(Robot::kPendubot, {}, PublishedTvlqr(plan)));
  EXPECT_TRUE(AtGoal(EndOf(Robot::kPendubot, {}, PublishedTvlqr(plan))));
  // Tolerance: the last published digit, and a little for the motion between the file's rows.
  EXPECT_NEAR(o.swing_up_seconds, 4.13, 1e-9);
  EXPECT_NEAR(o.energy, 9.53, 0.006);
  EXPECT_NEAR(o.torque_cost, 1.26, 0.006);
  EXPECT_NEAR(o.smoothness, 0.007, 0.0006);
  EXPECT_NEAR(o.velocity_cost, 211.12, 0.006);
  EXPECT_NEAR(o.max_torque, 1.77, 0.007);
  EXPECT_NEAR(PerformanceScore(o), 0.526, 0.0006);

  const std::vector<RobustnessCase> cases = RobustnessCases(1);
  ThreadPool pool(2);
  const auto ends = RunAll(static_cast<int>(cases.size()), &pool, nullptr, [&](int i) {
    return EndOf(Robot::kPendubot, cases[static_cast<size_t>(i)].episode, PublishedTvlqr(plan));
  });
  const Robustness judged = JudgeRobustness(cases, ends);
  // docs/results/realaigym.md has these scores.
  RecordProperty("S", std::to_string(PerformanceScore(o)));
  RecordProperty("R", std::to_string(judged.score()));
  const auto& [model, velocity, torque, response, delay, pushes] = judged.rows;
  // Rows without random draws. One cell of the model is at an edge that rounding can move.
  EXPECT_NEAR(model, 132.0 / 210, 1.1 / 210);
  EXPECT_EQ(response, 1);
  EXPECT_NEAR(delay, 9.0 / 21, 1e-12);
  // Rows with noise and pushes. Tolerance: two levels, two standard deviations of 50 draws, and
  // their effect on the score.
  EXPECT_NEAR(velocity, 19.0 / 21, 2.1 / 21);
  EXPECT_EQ(torque, 1);
  EXPECT_NEAR(pushes, 0.64, 2 * std::sqrt(0.64 * 0.36 / 50));
  EXPECT_NEAR(judged.score(), 0.767, 0.04);
}

}  // namespace
}  // namespace upswing::realaigym
