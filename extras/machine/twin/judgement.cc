#include "extras/machine/twin/judgement.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/format.h"
#include "base/sample.h"
#include "extras/machine/logs/angle_noise.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/logs/windows.h"
#include "extras/machine/twin/residuals.h"
#include "extras/machine/twin/validate.h"

namespace upswing::machine {
namespace {

constexpr double kSeconds = 1;       // length of a window of UsualPlant, s
constexpr double kStepShare = 0.05;  // time of a change of velocity, as a share of the window

/// The angles of a joint in a window, measured and predicted less measured.
struct WindowSeries {
  std::array<Series, 2> measured, residual;  // (joints) rad
};

/// A window, with the prediction from the start state that suits it best.
struct Explained {
  WindowSeries series;
  double gravity = 0;  // GravitySquares
};

/// The start state with the least squared errors of the angles, by Levenberg and Marquardt's
/// method.
Eigen::Vector4d BestStart(const ModelledLog& modelled, const LogWindow& window) {
  constexpr int kSteps = 8;
  constexpr double kEnough = 1e-3;  // least relative decrease of a step
  Eigen::Vector4d x(window.start.q1, window.start.q2, window.start.w1, window.start.w2);
  WindowResiduals now = ResidualsOf(modelled, window, x, /*linearizes=*/true);
  double damping = 1e-4;
  for (int i = 0; i < kSteps; ++i) {
    Eigen::Matrix4d H = now.angle.H.topLeftCorner<4, 4>();
    H.diagonal() *= 1 + damping;
    const Eigen::Vector4d next = x - H.ldlt().solve(now.angle.g.head<4>());
    if (!next.allFinite()) break;
    WindowResiduals then = ResidualsOf(modelled, window, next, /*linearizes=*/true);
    if (!(then.angle.mean < now.angle.mean)) {
      damping *= 100;
      continue;
    }
    const bool is_enough = then.angle.mean > (1 - kEnough) * now.angle.mean;
    x = next;
    now = std::move(then);
    damping /= 10;
    if (is_enough) break;
  }
  return x;
}

/// Sum over the rows of the squared sines of both links' angles against the vertical: gravity acts
/// on links in proportion to them.
double GravitySquares(const WindowSeries& series, const Twin& twin) {
  double sum = 0;
  for (size_t k = 0; k < series.measured[0].size(); ++k) {
    const double q1 = series.measured[0][k] - twin.sensors.zero1;
    const double q12 = q1 + series.measured[1][k] - twin.sensors.zero2;
    sum += std::pow(std::sin(q1), 2) + std::pow(std::sin(q12), 2);
  }
  return sum;
}

/// An error of a prediction, rad. One that overflows is worse than any motion; medians cannot sort
/// NaN.
double Finite(double error) {
  constexpr double kLost = 1e6;  // rad
  return std::abs(error) < kLost ? error : kLost;
}

Explained Explain(const ModelledLog& modelled, const Twin& twin, const LogWindow& window) {
  const MachineLog& log = modelled.log;
  const Eigen::Vector4d x = BestStart(modelled, window);
  const Motion motion = Predict(modelled.model, {x(0), x(1), x(2), x(3)}, window.TimesIn(log));
  Explained result;
  for (int k = 0; k < window.rows(); ++k) {
    for (int j = 0; j < 2; ++j) {
      const double angle = log.angle[window.first + k][j];
      result.series.measured[j].push_back(angle);
      result.series.residual[j].push_back(Finite(motion.angle[k][j] - angle));
    }
  }
  result.gravity = GravitySquares(result.series, twin);
  return result;
}

double Squares(const Series& x) {
  double sum = 0;
  for (const double value : x) sum += value * value;
  return sum;
}

/// Sum of the squared distances from the best straight line.
double SquaresAboutLine(const Series& x) {
  Pairs pairs;
  for (size_t k = 0; k < x.size(); ++k) pairs.Add(static_cast<double>(k), x[k]);
  return std::max(0.0, pairs.Syy() - pairs.gain() * pairs.Sxy());
}

/// Sum of the squared changes of velocity between two steps of `stride` values, times the step.
double SquaredBends(const Series& x, int stride) {
  double sum = 0;
  for (size_t k = 2 * stride; k < x.size(); ++k) {
    const double bend = x[k] - 2 * x[k - stride] + x[k - 2 * stride];
    sum += bend * bend;
  }
  return sum;
}

WindowError ErrorOf(const Explained& explained, const Joints& noise) {
  constexpr double kBendOfNoise = 6;  // variance of x - 2 y + z
  WindowError window;
  const auto n = explained.series.measured[0].size();
  const int stride = std::max(1, static_cast<int>(kStepShare * static_cast<double>(n)));
  double error = 0, line = 0, bends = 0, unexplained = 0;
  for (int j = 0; j < 2; ++j) {
    const Series &q = explained.series.measured[j], &r = explained.series.residual[j];
    const double of_noise =
        kBendOfNoise * noise[j] * noise[j] * static_cast<double>(q.size() - 2 * stride);
    error += Squares(r);
    line += SquaresAboutLine(q);
    bends += SquaredBends(q, stride) - of_noise;
    unexplained += SquaredBends(r, stride) - of_noise;
  }
  window.error = std::sqrt(error / static_cast<double>(n));
  window.motion = std::sqrt((line + explained.gravity) / static_cast<double>(n));
  window.step = bends > 0 ? std::sqrt(std::max(0.0, unexplained) / bends) : 0;
  return window;
}

/// The model that predicts a log: driven by its commands, or by reported torques if these are all
/// that it has.
ModelledLog ModelOf(const MachineLog& log, const Twin& twin) {
  ModelledLog modelled(log, twin);
  if (!HasDrive(log, /*reported=*/false)) modelled.model = ReportedModel(log, twin);
  return modelled;
}

std::vector<LogWindow> WindowsIn(const MachineLog& log, const Twin& twin, double seconds) {
  if (!HasDrive(log, false) && !HasDrive(log, true)) return {};
  return CutWindows(std::span(&log, 1), {.seconds = seconds, .hop = seconds}, twin.plant.length1,
                    twin.plant.length2);
}

/// The noise of each angle, rad: the smaller of two estimates, from the measured angles and from
/// the residuals.
Joints NoiseIn(std::span<const Explained> windows, int longest_stride) {
  Joints noise{};
  for (int j = 0; j < 2; ++j) {
    std::vector<Series> measured, residual;
    for (const Explained& w : windows) {
      measured.push_back(w.series.measured[j]);
      residual.push_back(w.series.residual[j]);
    }
    const int stride = StrideOf(measured, longest_stride);
    noise[j] = std::min(NoiseOf(measured, stride), NoiseOf(residual, stride));
  }
  return noise;
}

Explanation ExplanationOf(const Judgement& j) {
  // Real machines of 5 to 50 cm reach 0.1 and 0.14.
  constexpr double kUnexplained = 0.12, kUpperUnexplained = 0.25;
  constexpr double kNoise = 2, kClearNoise = 5;  // times the encoders' noise
  if (j.times_noise <= kNoise) return Explanation::kToNoise;
  const bool is_unexplained = j.share > kUnexplained || j.upper_share > kUpperUnexplained;
  if (is_unexplained && j.times_noise > kClearNoise) return Explanation::kNone;
  return Explanation::kToMultiple;
}

double MedianOver(const Judgement& judgement, double WindowError::*value) {
  std::vector<double> values;
  for (const WindowError& error : judgement.errors) values.push_back(error.*value);
  return Median(values);
}

}  // namespace

const char* NameOf(Explanation explanation) {
  switch (explanation) {
    case Explanation::kToNoise:
      return "to the noise";
    case Explanation::kToMultiple:
      return "to a multiple of the noise";
    case Explanation::kNone:
      return "not";
    default:
      return "unknown";
  }
}

Judgement Judge(std::span<const MachineLog> logs, std::span<const Twin> twins,
                const std::string& name, ThreadPool* pool) {
  Judgement judgement;
  judgement.logs = name;
  std::vector<std::vector<Explained>> of_logs(logs.size());
  for (double length = kSeconds; judgement.windows == 0 && length > kSeconds / 8; length /= 2) {
    judgement.seconds = length * ScaleOverUsual(twins.front().plant).time;
    ParallelFor(pool, static_cast<int>(logs.size()), [&](int i) {
      const auto windows = WindowsIn(logs[i], twins[i], judgement.seconds);
      const ModelledLog modelled = ModelOf(logs[i], twins[i]);
      for (const LogWindow& w : windows) of_logs[i].push_back(Explain(modelled, twins[i], w));
    });
    for (const auto& windows : of_logs) judgement.windows += static_cast<int>(windows.size());
  }
  if (judgement.windows == 0) return judgement;
  std::vector<Explained> all;
  for (auto& windows : of_logs) std::ranges::move(windows, std::back_inserter(all));
  int rows = 0;
  for (const Explained& w : all)
    rows = std::max(rows, static_cast<int>(w.series.measured[0].size()));
  const int longest_stride = std::max(1, static_cast<int>(kStepShare * rows));
  judgement.noise = NoiseIn(all, longest_stride);
  for (const Explained& w : all) judgement.errors.push_back(ErrorOf(w, judgement.noise));
  judgement.error = MedianOver(judgement, &WindowError::error);
  judgement.times_noise = judgement.error / std::hypot(judgement.noise[0], judgement.noise[1]);
  judgement.step_share = MedianOver(judgement, &WindowError::step);
  std::vector<double> shares;
  for (const WindowError& error : judgement.errors) shares.push_back(error.share());
  const Quartiles quartiles = QuartilesOf(shares);
  judgement.share = quartiles.median;
  judgement.upper_share = quartiles.high;
  judgement.explanation = ExplanationOf(judgement);
  return judgement;
}

std::string SentenceOf(const Judgement& j) {
  if (j.explanation == Explanation::kUnknown) {
    return fmt::format("{} have no motion away from upright that could judge the model", j.logs);
  }
  const std::string error = fmt::format("{:.2g} rad over {:.2g} s", j.error, j.seconds);
  const std::string times = FormatPlain(j.times_noise, 2) + " times the encoders' noise";
  const std::string share = FormatPercent(j.share) + " of the motion";
  constexpr double kWithoutNoise = 1e4;  // times: the logs of a simulation
  if (j.explains() && j.times_noise > kWithoutNoise) {
    return fmt::format("the model explains {} to {}: {}; the angles have no noise", j.logs, share,
                       error);
  }
  switch (j.explanation) {
    case Explanation::kToNoise:
      return fmt::format("the model explains {} to the encoders' noise: {}", j.logs, error);
    case Explanation::kToMultiple:
      return fmt::format("the model explains {} to {}: {}, {}", j.logs, times, error, share);
    default:
      return fmt::format("the model does not explain {}: {}, {}, {}", j.logs, error, times, share);
  }
}

}  // namespace upswing::machine
