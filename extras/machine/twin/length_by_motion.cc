#include "extras/machine/twin/length_by_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/format.h"
#include "extras/machine/logs/check.h"
#include "extras/machine/logs/weak_form.h"
#include "pendulum/scale.h"

namespace upswing::machine {
namespace {

constexpr int kBlocks = 8;  // of windows, for the deviation

/// The logarithm of length1 / g (s²), whatever the zeros of the encoders. It is not finite if the
/// motion shows none of it.
double LogRatio(const WeakEquations& equations) {
  const Eigen::VectorXd x = Fit(equations).constants;
  const double coupling = std::hypot(x(weak::kB), x(weak::kZeroB));
  const double gravity2 = std::hypot(x(weak::kG2), x(weak::kZero12));
  return std::log(coupling / gravity2);
}

/// The equations with the torques as late as explains the motion best. `cycle`: of the loop, s.
WeakEquations WithBestDelay(const WeakForm& form, double cycle) {
  constexpr double kCycles = 2, kEarliest = -0.05, kLatest = 0.15;  // natural times
  constexpr int kDelays = 50;
  const double first = kEarliest * form.time() - kCycles * cycle;  // s
  const double last = kLatest * form.time() + kCycles * cycle;     // s
  WeakEquations equations = form.Equations({}, {}, 0), best = equations;
  double least = Fit(equations).misfit();
  for (int i = 0; i <= kDelays; ++i) {
    form.SetTorques({}, first + (last - first) * i / kDelays, equations);
    const double misfit = Fit(equations).misfit();
    if (misfit >= least) continue;
    least = misfit;
    best = equations;
  }
  return best;
}

/// The equations without a block of their windows.
WeakEquations WithoutBlock(const WeakEquations& equations, int block) {
  const int n = equations.windows(), begin = n * block / kBlocks, end = n * (block + 1) / kBlocks;
  return equations.Selected([&](int row) { return row < begin || row >= end; });
}

/// The variance of LogRatio by leaving out blocks of windows (the jackknife; Tukey, 1958).
double JackknifeVariance(const WeakEquations& equations) {
  std::vector<double> values;
  double mean = 0, squares = 0;
  for (int block = 0; block < kBlocks; ++block) {
    values.push_back(LogRatio(WithoutBlock(equations, block)));
    mean += values.back() / kBlocks;
  }
  for (const double value : values) squares += (value - mean) * (value - mean);
  return squares * (kBlocks - 1) / kBlocks;
}

}  // namespace

std::optional<LengthByMotion> FindLengthByMotion(std::span<const MachineLog> logs,
                                                 const Twin& twin) {
  constexpr int kFewest = 24;  // windows
  // What friction and cogging that no model has do to all logs of a machine. The lengths by 60 logs
  // of three real machines are within 3% of the true ones.
  constexpr double kModelError = 0.03;
  double sum = 0, weight = 0;
  for (const MachineLog& log : logs) {
    const WeakForm form(std::span(&log, 1), NaturalUnits(twin.plant).time);
    if (form.windows() < kFewest) continue;
    const WeakEquations equations = WithBestDelay(form, UsualCycle(std::span(&log, 1)));
    // A perfect log counts no more than the model can tell.
    const double variance = std::max(JackknifeVariance(equations), kModelError * kModelError / 100);
    const double value = LogRatio(equations);
    if (!std::isfinite(value) || !std::isfinite(variance)) continue;
    sum += value / variance;
    weight += 1 / variance;
  }
  if (weight == 0) return std::nullopt;
  return LengthByMotion{twin.plant.gravity * std::exp(sum / weight),
                        std::sqrt(1 / weight + kModelError * kModelError)};
}

std::string LengthContradiction(std::span<const MachineLog> logs, const Twin& twin,
                                double length1) {
  constexpr double kDeviations = 3;
  constexpr double kVague = 0.06;  // a deviation above which 20% would not be seen
  const auto found = FindLengthByMotion(logs, twin);
  if (!found || found->deviation > kVague) return "";
  const double ratio = found->length / length1;
  if (std::abs(std::log(ratio)) < kDeviations * found->deviation) return "";
  // A clock that runs fast by a factor makes all accelerations less by its square.
  const double clock = std::sqrt(ratio);
  return fmt::format(
      "the motion shows length1 = {:.3g} m ± {}, not {:.3g} m: is the length wrong, does the "
      "clock run {} {}, or is gravity {:.3g} m/s²?",
      found->length, FormatPercent(found->deviation), length1,
      FormatPercent(std::abs(clock - 1)), clock > 1 ? "fast" : "slow", twin.plant.gravity / ratio);
}

}  // namespace upswing::machine
