#include "extras/machine/logs/weak_form.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/sample.h"
#include "extras/machine/logs/check.h"
#include "pendulum/regressor.h"

namespace upswing::machine {
namespace {

// Times in natural times of the machine.
constexpr double kBlock = 0.08;        // of a knot
constexpr double kWindowLength = 1.6;  // of a window
constexpr double kLongestGap = 0.5;    // between knots of a window
constexpr double kFrictionTime = 10;   // velocity of dry friction, in its tanh(time · velocity)
constexpr double kTurnOfBlock = 0.25;  // largest angle between two knots, rad
constexpr int kMostWindows = 400;      // more would only take longer
constexpr int kPointsOfBlock = 3;

/// Torques of a row after a reading, N·m. `place`: of the row in the log, from 0 to 1.
Joints Read(const TorqueReading& reading, const Joints& torque, double place) {
  Joints read{};
  const double flip = reading.flips_at >= 0 && place > reading.flips_at ? -1 : 1;
  for (const int j : {0, 1}) {
    double u = flip * reading.sign[j] * torque[reading.swapped ? 1 - j : j];
    const double largest = reading.largest[j], dead_band = reading.dead_band[j];
    if (largest > 0) u = std::clamp(u, -largest, largest);
    if (dead_band > 0) {
      const double beyond = std::max(0.0, std::abs(u) - dead_band);
      const double arrives = reading.only_small && beyond > 0 ? std::abs(u) : beyond;
      u = std::copysign(arrives, u);
    }
    read[j] = u;
  }
  return read;
}

/// The time (s) before each piece of a log, and that of the whole log.
std::vector<double> BeginsOf(std::span<const MachineLog> pieces) {
  std::vector<double> begins{0};
  for (const MachineLog& log : pieces) begins.push_back(begins.back() + log.time.back());
  return begins;
}

/// Columns whose coefficients are not negative come first.
constexpr int kNotNegative = weak::kZero1;

/// Minimises ½ xᵀ gram x - targetᵀ x, where x is not negative but for the indices in `is_free`
/// (Lawson and Hanson, "Solving Least Squares Problems", 1974, Chapter 23).
Eigen::VectorXd SolveNotNegative(const Eigen::MatrixXd& gram, const Eigen::VectorXd& target,
                                 const std::vector<bool>& is_free) {
  const int n = static_cast<int>(target.size());
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  std::vector<bool> active = is_free;
  const auto solve = [&] {
    std::vector<int> own;
    for (int i = 0; i < n; ++i) {
      if (active[i]) own.push_back(i);
    }
    Eigen::VectorXd solution = Eigen::VectorXd::Zero(n);
    if (!own.empty()) solution(own) = gram(own, own).ldlt().solve(target(own)).eval();
    return solution;
  };
  // The smallest step from x to `next` at which an active one reaches 0 ends it.
  const auto take_back = [&](const Eigen::VectorXd& next) {
    double share = 1;
    for (int i = 0; i < n; ++i) {
      if (active[i] && !is_free[i] && next(i) <= 0)
        share = std::min(share, x(i) / (x(i) - next(i)));
    }
    x += share * (next - x);
    for (int i = 0; i < n; ++i) {
      if (active[i] && !is_free[i] && x(i) <= 1e-14) {
        active[i] = false;
        x(i) = 0;
      }
    }
    return share < 1;
  };
  // Rounding errors of the gradient, of the sums in it.
  constexpr double kRounding = 1e-12;
  std::vector<bool> is_blocked(n, false);  // rounding errors would take it back at once
  for (int round = 0; round < 3 * n; ++round) {
    Eigen::VectorXd next = solve();
    for (int inner = 0; inner < n && take_back(next); ++inner) next = solve();
    const Eigen::VectorXd descent = target - gram * x;
    const Eigen::VectorXd sums = target.cwiseAbs() + gram.cwiseAbs() * x.cwiseAbs();
    int best = -1;
    for (int i = 0; i < n; ++i) {
      if (active[i] || is_blocked[i] || descent(i) <= kRounding * sums(i)) continue;
      if (best < 0 || descent(i) > descent(best)) best = i;
    }
    if (best < 0) break;
    active[best] = true;
    if (solve()(best) <= 0) {
      active[best] = false;
      is_blocked[best] = true;
    }
  }
  return x;
}

/// Products of the columns of the equations of each joint.
using Grams = std::array<Eigen::MatrixXd, 2>;

Grams GramsOf(const std::array<Eigen::MatrixXd, 2>& columns) {
  return {columns[0].transpose() * columns[0], columns[1].transpose() * columns[1]};
}

/// Whether each column's coefficient may have any sign: those of zeros, and `more` columns.
std::vector<bool> FreeColumns(int more) {
  std::vector<bool> is_free(weak::kColumns + more, true);
  std::fill_n(is_free.begin(), kNotNegative, false);
  return is_free;
}

/// Finds the constants with the least unexplained share. The scale of the constants is arbitrary:
/// the sum of the inertias, each by the size of its column, is fixed.
WeakFit Solve(const Grams& grams, const std::vector<bool>& is_free, int windows) {
  const int n = static_cast<int>(is_free.size());
  Eigen::VectorXd size = ((grams[0].diagonal() + grams[1].diagonal()) / (2 * windows)).cwiseSqrt();
  for (int i = 0; i < n; ++i) {
    if (!(size(i) > 0)) size(i) = 1;
  }
  const Eigen::MatrixXd scaling = size.cwiseInverse().asDiagonal();
  std::array<Eigen::MatrixXd, 2> scaled;
  for (const int row : {0, 1}) scaled[row] = scaling * grams[row] * scaling / windows;
  Eigen::VectorXd target = Eigen::VectorXd::Zero(n);
  for (const int i : {weak::kJ1, weak::kJ2, weak::kB}) target(i) = 1;
  // The mean square of some terms of an equation.
  const auto square = [&](int row, const Eigen::VectorXd& x, const std::vector<int>& columns) {
    const Eigen::VectorXd part = x(columns);
    return std::max(0.0, part.dot(scaled[row](columns, columns) * part));
  };
  // Where the zero of an angle is wrong, a part of gravity is in the column of the zero.
  const std::vector<int> inertias{weak::kJ1, weak::kJ2, weak::kB, weak::kA};
  const std::vector<int> gravities{weak::kG1, weak::kG2, weak::kZero1, weak::kZero12};
  WeakFit fit;
  Joints weight{1, 1};
  constexpr int kRounds = 3;
  constexpr double kLeastShare = 1e-9;  // unexplained; a smaller one would get all the weight
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixXd gram = weight[0] * scaled[0] + weight[1] * scaled[1];
    gram.diagonal().array() += 1e-12 * gram.trace() / n;
    const Eigen::VectorXd x = SolveNotNegative(gram, target, is_free);
    Joints left{};
    for (const int row : {0, 1}) {
      left[row] = std::max(0.0, x.dot(scaled[row] * x));
      const double motion = square(row, x, inertias) + square(row, x, gravities);
      fit.motion[row] = motion;
      fit.unexplained[row] = motion > 0 ? left[row] / motion : 1;
      left[row] = std::max(left[row], kLeastShare * motion);
    }
    const double least = std::min(left[0], left[1]);
    for (const int row : {0, 1}) weight[row] = left[row] > 0 ? least / left[row] : 1;
    fit.constants = scaling * x;
  }
  const auto used = static_cast<double>((fit.constants.array() != 0).count());
  fit.freedom = std::max(0.05, 1 - used / (2 * windows));
  return fit;
}

}  // namespace

WeakEquations WeakEquations::Selected(const std::function<bool(int row)>& keeps) const {
  std::vector<int> rows;
  WeakEquations some;
  some.length = length;
  for (int row = 0; row < windows(); ++row) {
    if (!keeps(row)) continue;
    rows.push_back(row);
    some.when.push_back(when[row]);
  }
  for (const int joint : {0, 1}) some.A[joint] = A[joint](rows, Eigen::all);
  return some;
}

TorqueIntegral::TorqueIntegral(const MachineLog& log, const TorqueReading& reading, double before,
                               double seconds)
    : time_(log.time), integral_(log.time.size()) {
  const auto place = [&](int k) { return (before + log.time[k]) / seconds; };
  const bool is_measured = HasTorque(log.measured, 0) || HasTorque(log.measured, 1);
  for (int k = 1; k < log.rows(); ++k) {
    const double h = log.time[k] - log.time[k - 1];
    Joints mean{};
    if (is_measured) {
      const Joints a = Read(reading, log.measured[k - 1], place(k - 1));
      const Joints b = Read(reading, log.measured[k], place(k));
      mean = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2};
    } else if (k >= 2) {  // the command of a row is sent while the angles of the next one are read
      Joints sent = log.commanded.empty() ? Joints{} : log.commanded[k - 2];
      sent = Read(reading, sent, place(k - 2));
      const Joints push = log.push.empty() ? Joints{} : log.push[k - 2];
      mean = {sent[0] + push[0], sent[1] + push[1]};
    }
    for (const int j : {0, 1}) integral_[k][j] = integral_[k - 1][j] + h * mean[j];
  }
}

Joints TorqueIntegral::At(double time) {
  if (time <= time_.front()) return {};
  if (time >= time_.back()) return integral_.back();
  while (next_ > 1 && time_[next_ - 1] > time) --next_;
  while (time_[next_] <= time) ++next_;
  const double share = (time - time_[next_ - 1]) / (time_[next_] - time_[next_ - 1]);
  const Joints &a = integral_[next_ - 1], &b = integral_[next_];
  return {a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])};
}

WeakForm::WeakForm(std::span<const MachineLog> pieces, double time)
    : pieces_(pieces), time_(time), length_(kWindowLength * time) {
  std::vector<double> speeds;
  for (const MachineLog& log : pieces) {
    const SmoothMotion& motion = motions_.emplace_back(log, kBlock * time);
    if (motion.empty()) continue;
    double next = motion.begin();
    for (const double t : motion.knots()) {
      if (t < next) continue;
      speeds.push_back(std::hypot(motion.At(0, t).velocity, motion.At(1, t).velocity));
      next = t + time;
    }
  }
  if (speeds.empty()) return;
  std::ranges::sort(speeds);
  constexpr double kFast = 0.9;  // quantile
  const double fast = Quantile(speeds, kFast);
  // Fast turns need closer knots than slow ones.
  const double block = kTurnOfBlock / std::max(fast, 1e-9);
  if (block < kBlock * time) {
    motions_.clear();
    for (const MachineLog& log : pieces) motions_.emplace_back(log, block);
  }
  double spacing = 0;
  for (const SmoothMotion& motion : motions_) spacing = std::max(spacing, motion.spacing());
  step_ = std::min(spacing, kBlock * time) / kPointsOfBlock;
  const int points = std::max(8, static_cast<int>(std::lround(length_ / step_)));
  step_ = length_ / points;
  weight_.resize(points + 1);
  slope_.resize(points + 1);
  for (int i = 0; i <= points; ++i) {  // φ = sin²(π x)
    const double x = static_cast<double>(i) / points;
    weight_(i) = std::pow(std::sin(std::numbers::pi * x), 2) * step_;
    slope_(i) = std::numbers::pi / length_ * std::sin(2 * std::numbers::pi * x) * step_;
  }
  // Slower motion tells of friction only.
  constexpr double kQuiet = 0.25;  // rad in a natural time, or share of the fast motion
  FindWindows(std::min(kQuiet / time, kQuiet * fast));
}

double WeakForm::NoiseGain(double cycle) const {
  // φ'' = 2 π² / L² cos(2 π t / L), whose square has the integral 2 π⁴ / L³.
  return cycle * 2 * std::pow(std::numbers::pi, 4) / std::pow(length_, 3);
}

WeakForm WeakForm::Thinned(int most) const {
  WeakForm thin = *this;
  const int stride = (windows() + most - 1) / most;
  thin.windows_.clear();
  for (int i = 0; i < windows(); i += stride) thin.windows_.push_back(windows_[i]);
  return thin;
}

std::vector<WeakForm::Sample> WeakForm::SamplesOf(int piece, double begin, double late) const {
  const SmoothMotion& motion = motions_[piece];
  std::vector<Sample> samples;
  for (int i = 0; i < weight_.size(); ++i) {
    const double t = begin + i * step_;
    const auto first = motion.At(0, t), second = motion.At(1, t + late);
    samples.push_back({{first.angle, second.angle}, {first.velocity, second.velocity}});
  }
  return samples;
}

/// The longest gap between the knots of a window, s.
double WeakForm::LongestGap(const SmoothMotion& motion) const {
  return std::max(kLongestGap * time_, 3 * motion.spacing());
}

void WeakForm::FindWindows(double quiet) {
  double seconds = 0;  // without gaps
  for (const SmoothMotion& motion : motions_) {
    const std::span<const double> knots = motion.knots();
    for (size_t i = 1; i < knots.size(); ++i) {
      seconds += std::min(knots[i] - knots[i - 1], LongestGap(motion));
    }
  }
  const double hop = std::max(length_ / 2, seconds / kMostWindows);
  for (int piece = 0; piece < static_cast<int>(motions_.size()); ++piece) {
    const SmoothMotion& motion = motions_[piece];
    if (motion.empty()) continue;
    // A tenth of a natural time is left at both ends for angles that are late.
    const double margin = 0.11 * time_;
    for (double begin = motion.begin() + margin; begin + length_ + margin < motion.end();
         begin += hop) {
      const auto end = motion.EndOfGap(begin, begin + length_, LongestGap(motion));
      if (end) {  // go on after the gap, with as many hops as that takes
        begin += std::max(0.0, std::ceil((*end - begin) / hop) - 1) * hop;
        continue;
      }
      Window window{piece, begin, SamplesOf(piece, begin, 0)};
      double squares = 0;
      for (const Sample& s : window.samples) squares += s.w[0] * s.w[0] + s.w[1] * s.w[1];
      const double speed = std::sqrt(squares / static_cast<double>(window.samples.size()));
      if (speed >= quiet) windows_.push_back(std::move(window));
    }
  }
}

void WeakForm::SetMotion(const AngleReading& reading, const Window& window, double place, int row,
                         WeakEquations& equations) const {
  using namespace weak;
  const double turned = reading.TurnedAt(place);
  const Joints zero{reading.zero[0] + turned * reading.turn[0],
                    reading.zero[1] + turned * reading.turn[1]};
  const std::vector<Sample> late = reading.late != 0
                                       ? SamplesOf(window.piece, window.begin, reading.late)
                                       : std::vector<Sample>();
  const std::vector<Sample>& samples = reading.late != 0 ? late : window.samples;
  std::array<Eigen::Matrix<double, kColumns, 1>, 2> sum;
  for (auto& of_joint : sum) of_joint.setZero();
  for (int i = 0; i < weight_.size(); ++i) {
    Joints q = reading.Of(samples[i].q);
    const Joints w = reading.Of(samples[i].w);
    for (const int j : {0, 1}) q[j] += zero[j];
    const auto angles = dynamics::AnglesOf<double>({q[0], q[1]});
    const auto& [s1, c1, s2, c2] = angles;
    const auto plain = MomentumRegressorOf(angles, {w[0], w[1]});
    const double phi = weight_(i), slope = slope_(i);
    // ∫ φ (d/dt p + force) = ∫ φ force - φ' p
    for (const int joint : {0, 1}) {
      for (int c = 0; c < kNumManipulatorConstants; ++c) {
        sum[joint](c) += phi * plain.force[joint][c] - slope * plain.momentum[joint][c];
      }
      sum[joint](kF1 + joint) += phi * std::tanh(kFrictionTime * time_ * w[joint]);
    }
    // Derivatives of gravity and coupling by the zeros of the angles.
    const double c12 = c1 * c2 - s1 * s2;
    sum[0](kZero1) += phi * c1;
    for (const int joint : {0, 1}) sum[joint](kZero12) += phi * c12;
    sum[0](kZeroB) += slope * s2 * (2 * w[0] + w[1]);
    sum[1](kZeroB) += slope * s2 * w[0] + phi * c2 * w[0] * (w[0] + w[1]);
  }
  for (const int joint : {0, 1}) equations.A[joint].row(row) = sum[joint].transpose();
}

WeakEquations WeakForm::Equations(const AngleReading& angles, const TorqueReading& torques,
                                  double delay) const {
  WeakEquations equations;
  for (const int joint : {0, 1}) equations.A[joint].setZero(windows(), weak::kColumns);
  const std::vector<double> before = BeginsOf(pieces_);
  const double seconds = before.back();
  equations.length = length_ / seconds;
  for (int row = 0; row < windows(); ++row) {
    const Window& window = windows_[row];
    const double place = (before[window.piece] + window.begin + length_ / 2) / seconds;
    SetMotion(angles, window, place, row, equations);
    equations.when.push_back(place);
  }
  SetTorques(torques, delay, equations);
  return equations;
}

void WeakForm::SetTorques(const TorqueReading& torques, double delay,
                          WeakEquations& equations) const {
  const std::vector<double> begins = BeginsOf(pieces_);
  std::vector<TorqueIntegral> integrals;
  for (size_t i = 0; i < pieces_.size(); ++i) {
    integrals.emplace_back(pieces_[i], torques, begins[i], begins.back());
  }
  for (int row = 0; row < windows(); ++row) {
    const Window& window = windows_[row];
    TorqueIntegral& integral = integrals[window.piece];
    Joints sum{};
    Joints last = integral.At(window.begin - step_ / 2 - delay);
    for (int i = 0; i < weight_.size(); ++i) {
      const Joints now = integral.At(window.begin + (i + 0.5) * step_ - delay);
      for (const int j : {0, 1}) sum[j] += weight_(i) / step_ * (now[j] - last[j]);
      last = now;
    }
    equations.A[0](row, weak::kTorque1) = -sum[0];
    equations.A[1](row, weak::kTorque2) = -sum[1];
  }
}

double WeakFit::left() const { return std::max(unexplained[0], unexplained[1]); }

double WeakFit::misfit() const {
  constexpr double kLeast = 2e-6;
  return std::log(std::max(unexplained[0], kLeast)) + std::log(std::max(unexplained[1], kLeast));
}

WeakFit Fit(const WeakEquations& equations, const std::array<Eigen::MatrixXd, 2>& free) {
  const auto more = static_cast<int>(free[0].cols());
  if (more == 0) return Solve(GramsOf(equations.A), FreeColumns(0), equations.windows());
  std::array<Eigen::MatrixXd, 2> all;
  for (const int joint : {0, 1}) {
    all[joint].resize(equations.windows(), weak::kColumns + more);
    all[joint] << equations.A[joint], free[joint];
  }
  return Solve(GramsOf(all), FreeColumns(more), equations.windows());
}

WeakFit FitAnyZeroAndSign(const WeakEquations& equations) {
  std::vector<bool> is_free = FreeColumns(0);
  for (const int i : {weak::kB, weak::kG1, weak::kG2, weak::kTorque1, weak::kTorque2}) {
    is_free[i] = true;
  }
  return Solve(GramsOf(equations.A), is_free, equations.windows());
}

Zeros WeakFit::zeros() const {
  using namespace weak;
  const auto angle = [&](Column turned, Column plain) {
    return std::atan2(constants(turned), constants(plain));
  };
  return {angle(kZero1, kG1), angle(kZero12, kG2), angle(kZeroB, kB)};
}

double NaturalTimeOf(const Eigen::VectorXd& x) {
  using namespace weak;
  const double gravity = std::hypot(x(kG1), x(kZero1)) + std::hypot(x(kG2), x(kZero12));
  const double inertia = x(kJ1) + x(kJ2) + 2 * std::hypot(x(kB), x(kZeroB));
  return gravity > 0 ? std::sqrt(inertia / gravity) : 0;
}

}  // namespace upswing::machine
