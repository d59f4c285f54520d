// Hypotheses about conventions: signs, units, joints and zeros of angles and torques.
#include <algorithm>
#include <cmath>
#include <optional>

#include "extras/machine/logs/hypotheses.h"

namespace upswing::machine {
namespace {

/// All ways to read angles with these ranges (rad) that are another convention, without their
/// mirror images. `absolute`: whether the file's angles of joint 2 are against the vertical.
std::vector<AngleReading> Readings(const Joints& range, bool absolute) {
  constexpr double kLeast = 0.3, kMost = 1000;  // rad
  std::vector<AngleReading> readings;
  for (const Joints& unit : {Joints{1, 1},
                             {kFullTurn, kFullTurn},
                             {kOneDegree, kOneDegree},
                             {kOneDegree, 1},
                             {1, kOneDegree}}) {
    const bool is_unlikely = std::ranges::any_of(std::array{0, 1}, [&](int j) {
      const double moves = unit[j] * range[j];
      return unit[j] != 1 && (moves < kLeast || moves > kMost);
    });
    if (is_unlikely) continue;
    for (const double sign : {1, -1}) {
      for (const bool swapped : {false, true}) {
        // Other readings of the columns are the same as one of the angles.
        if (!absolute || (unit[0] == unit[1] && sign > 0 && !swapped)) continue;
        readings.push_back(
            {.absolute = true, .scale = {unit[0], sign * unit[1]}, .swapped = swapped});
      }
      for (const double link1 : {0, 1, -1}) {
        for (const bool swapped : {false, true}) {
          readings.push_back(
              {.scale = {unit[0], sign * unit[1]}, .link1 = link1, .swapped = swapped});
        }
      }
    }
  }
  return readings;
}

}  // namespace

void Hypotheses::TryReadings() {
  for (const AngleReading& reading : Readings(range_, absolute_)) TryReading(reading);
}

/// Tries a reading and its mirror image, both with all joints of the torques.
void Hypotheses::TryReading(const AngleReading& reading) {
  Hypothesis h = log_;
  h.angles = reading;
  WeakEquations equations = EquationsOf(h);
  for (const bool swapped : {false, true}) {
    if (swapped && !IsDriven()) continue;
    h.torques.swapped = swapped;
    if (swapped) SetTorques(h.torques, h.delay, equations);
    // No zeros and signs explain more than this, of the mirror image as well.
    h.fit = FitAnyZeroAndSign(equations);
    for (const double mirror : {1, -1}) {
      Hypothesis next = h;
      for (double& scale : next.angles.scale) scale *= mirror;
      if (next.cost(per_change_) < least_cost_) TryZerosAndSigns(next);
    }
  }
}

/// Tries a reading with its zeros and with others, and with all signs of the torques.
void Hypotheses::TryZerosAndSigns(const Hypothesis& h) {
  TrySigns(h);
  const auto [zero1, zero12, zero2] = FitAnyZeroAndSign(EquationsOf(h)).zeros();
  for (const Joints& zero :
       {Joints{zero1, zero12 - zero1}, {zero12 - zero2, zero2}, {zero1, zero2}}) {
    Hypothesis turned = h;
    turned.angles.zero = zero;
    ImproveZeros(turned);
    TrySigns(turned);
  }
}

/// Adds the small zeros that the fit finds to those of the reading.
void Hypotheses::ImproveZeros(Hypothesis& h) const {
  for (int round = 0; round < 3; ++round) {
    const WeakFit fit = FitAnySign(h);
    if (!(fit.constants(weak::kG1) > 0) || !(fit.constants(weak::kG2) > 0)) return;
    const auto [zero1, zero12, zero2] = fit.zeros();
    h.angles.zero[0] = std::remainder(h.angles.zero[0] + zero1, kFullTurn);
    h.angles.zero[1] = std::remainder(h.angles.zero[1] + zero12 - zero1, kFullTurn);
  }
}

/// The best fit with any signs of the torques.
WeakFit Hypotheses::FitAnySign(const Hypothesis& h) const {
  std::optional<WeakFit> best;
  for (const WeakFit& fit : FitsOfSigns(h)) {
    if (!best || fit.misfit() < best->misfit()) best = fit;
  }
  return *best;
}

void Hypotheses::TrySigns(const Hypothesis& h) {
  const std::vector<Joints> signs = Signs(h.torques.swapped);
  const std::vector<WeakFit> fits = FitsOfSigns(h);
  for (size_t i = 0; i < signs.size(); ++i) {
    Hypothesis next = h;
    next.torques.sign = signs[i];
    next.fit = fits[i];
    Offer(next);
  }
}

/// The fits of a hypothesis with each of Signs.
std::vector<WeakFit> Hypotheses::FitsOfSigns(const Hypothesis& h) const {
  const WeakEquations equations = EquationsOf(h);
  std::vector<WeakFit> fits;
  for (const Joints& sign : Signs(h.torques.swapped)) {
    WeakEquations turned = equations;
    turned.A[0].col(weak::kTorque1) *= sign[0];
    turned.A[1].col(weak::kTorque2) *= sign[1];
    fits.push_back(FitSmallZeros(turned));
  }
  return fits;
}

/// The signs of torques that act.
std::vector<Joints> Hypotheses::Signs(bool swapped) const {
  const bool first = driven_[swapped ? 1 : 0], second = driven_[swapped ? 0 : 1];
  std::vector<Joints> signs;
  for (const Joints& sign : {Joints{1, 1}, {-1, 1}, {1, -1}, {-1, -1}}) {
    if ((sign[0] > 0 || first) && (sign[1] > 0 || second)) signs.push_back(sign);
  }
  return signs;
}

}  // namespace upswing::machine
