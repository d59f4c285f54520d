// Scans of hypotheses with a number: scales, times, limits of torques, and moments of a change.
#include <algorithm>
#include <cmath>

#include "extras/machine/logs/hypotheses.h"

namespace upswing::machine {

Hypothesis Hypotheses::Refined(Hypothesis found, double value, double step, double least,
                               const std::function<Hypothesis(double)>& with) {
  for (; step > least; step /= 2) {
    const double middle = value;
    for (const double near : {middle - step, middle + step}) {
      const Hypothesis next = with(near);
      // Below a limit all misfits are equal.
      const bool is_better = next.misfit() < found.misfit() || (next.misfit() == found.misfit() &&
                                                                next.fit.left() < found.fit.left());
      if (!is_better) continue;
      found = next;
      value = near;
    }
  }
  return found;
}

void Hypotheses::TryScales() {
  for (const double scale :
       {1.0 / 2, 1.0 / 3, 1.0 / 4, 1.0 / 5, 1.0 / 6, 1.0 / 7, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0}) {
    for (const Joints& both : {Joints{scale, 1}, {1, scale}, {scale, scale}}) {
      Offer(WithAngles({.scale = both}));
      // Both columns of absolute angles have the scale of both angles.
      if (absolute_ && both[0] != both[1]) Offer(WithAngles({.absolute = true, .scale = both}));
    }
  }
  for (const int joint : {0, 1}) {
    TryScale(joint, /*absolute=*/false);
    if (absolute_) TryScale(joint, /*absolute=*/true);
  }
}

/// Tries scales near 1. Where a joint turns round often, a scale explains nothing until it is
/// nearly exact.
void Hypotheses::TryScale(int joint, bool absolute) {
  constexpr double kLeast = 0.7, kMost = 1.4, kWidest = 0.05;
  constexpr double kTurn = 0.7, kExact = 0.004;  // rad at the end of the range
  constexpr double kFarthest = 150;              // rad; a finer scan would take too long
  const double range = std::clamp(range_[joint], 1.0, kFarthest);
  const double step = std::min(kWidest, kTurn / range);
  const auto reading = [&](double scale) {
    AngleReading angles{.absolute = absolute};
    angles.scale[joint] = scale;
    return angles;
  };
  const auto thin_misfit = [&](double scale) {
    Hypothesis next = log_;
    next.angles = reading(scale);
    return Fit(EquationsOf(thin_, next)).misfit();
  };
  double best = 1, least = thin_misfit(1);
  for (double scale = kLeast; scale <= kMost; scale += step) {
    const double misfit = thin_misfit(scale);
    if (misfit >= least) continue;
    least = misfit;
    best = scale;
  }
  const auto with = [&](double scale) { return WithAngles(reading(scale)); };
  Offer(Refined(with(best), best, step / 2, kExact / range, with));
}

void Hypotheses::TryTimes() {
  constexpr double kLatest = 0.2, kStep = 0.025, kExact = 0.003;  // natural times
  const auto late = [&](double time) { return WithAngles({.late = time * form_.time()}); };
  double best = 0, least = Fit(EquationsOf(thin_, log_)).misfit();
  for (double time = -kLatest; time < kLatest + kStep / 2; time += kStep) {
    Hypothesis next = log_;
    next.angles.late = time * form_.time();
    const double misfit = Fit(EquationsOf(thin_, next)).misfit();
    if (misfit >= least) continue;
    least = misfit;
    best = time;
  }
  Offer(Refined(late(best), best, kStep / 2, kExact, late));
  if (!IsDriven()) return;
  TryLateTorques(1);
  TryLateTorques(-1);
}

/// Tries torques that are recorded earlier than they act (`way` 1) or later (-1), by more than a
/// motor's delay.
void Hypotheses::TryLateTorques(int way) {
  constexpr double kLeast = 0.15, kMost = 1.7, kStep = 0.06, kExact = 0.005;  // natural times
  const std::vector<double> usual = UsualDelays();
  const double nearest = way > 0 ? usual.back() : -usual.front();
  const auto with = [&](double time) {
    const double delay = std::max(nearest, time * form_.time());
    Hypothesis next = WithTorques({}, way * delay);
    next.is_late = true;
    return next;
  };
  double best = kLeast;
  Hypothesis found = with(best);
  for (double time = kLeast + kStep; time < kMost; time += kStep) {
    const Hypothesis next = with(time);
    if (next.misfit() >= found.misfit()) continue;
    found = next;
    best = time;
  }
  Offer(Refined(found, best, kStep / 2, kExact, with));
}

void Hypotheses::TryTorques() {
  if (!IsDriven()) return;
  TryLimits(&TorqueReading::largest, false);
  TryLimits(&TorqueReading::dead_band, false);
  TryLimits(&TorqueReading::dead_band, true);
  const auto flipped = [&](double place) {
    return WithTorques({.flips_at = std::clamp(place, 0.02, 0.98)}, log_.delay);
  };
  TryPlaces(0.1, flipped);
  for (const int joint : {0, 1}) {
    if (driven_[joint]) Offer(WithChange({Change::kOffset, 0, joint}));
  }
}

/// Tries limits of the torques of one joint and of both, as shares of the largest ones.
void Hypotheses::TryLimits(Joints TorqueReading::*limit, bool only_small) {
  Hypothesis found = log_;
  for (const int joint : {0, 1}) {
    if (!driven_[joint]) continue;
    TorqueReading reading = found.torques;
    reading.only_small = only_small;
    const auto with = [&](double share) {
      (reading.*limit)[joint] = std::clamp(share, 0.01, 0.99) * largest_[joint];
      return WithTorques(reading, log_.delay);
    };
    double best = 0;
    for (double share = 0.1; share < 0.95; share += 0.1) {
      const Hypothesis next = with(share);
      if (next.misfit() >= found.misfit()) continue;
      found = next;
      best = share;
    }
    if (best > 0) found = Refined(found, best, 0.05, 0.005, with);
  }
  Offer(found);
}

/// Tries all places in the log, `step` apart, and places near the best one.
void Hypotheses::TryPlaces(double step, const std::function<Hypothesis(double)>& with) {
  double best = step;
  Hypothesis found = with(best);
  for (double place = 2 * step; place < 0.92; place += step) {
    const Hypothesis next = with(place);
    if (next.misfit() >= found.misfit()) continue;
    found = next;
    best = place;
  }
  found = Refined(found, best, step / 2, std::min(step / 4, equations_.length / 2), with);
  Offer(found.change.kind == Change::kSlip ? Turned(found) : found);
}

void Hypotheses::TryEncoders() {
  TryPlaces(0.05, [&](double place) {
    return WithChange({Change::kSlip, std::clamp(place, 0.05, 0.95)});
  });
  TryDrift();
}

/// Tries clocks that go on at another rate from a place in the log on.
void Hypotheses::TryClock() {
  constexpr double kStep = 0.1, kExactPlace = 0.01, kExactRate = 0.002;
  constexpr double kSlowest = 0.7, kFastest = 1.4;  // beyond, a decaying swing has other causes
  const auto with = [&](double place, double rate) {
    return WithChange(
        {Change::kClock, std::clamp(place, 0.05, 0.95), 0, std::clamp(rate, kSlowest, kFastest)});
  };
  Hypothesis best = log_;
  for (double place = kStep; place < 0.95; place += kStep) {
    for (const double rate : {0.75, 0.85, 0.95, 1.05, 1.15, 1.3}) {
      const Hypothesis next = with(place, rate);
      if (next.misfit() < best.misfit()) best = next;
    }
  }
  if (best.change.kind != Change::kClock) return;
  constexpr int kRounds = 2;
  for (int round = 0; round < kRounds; ++round) {
    const Change found = best.change;
    best = Refined(best, found.rate, 0.1 * found.rate, kExactRate,
                   [&](double rate) { return with(found.place, rate); });
    const double rate = best.change.rate;
    best = Refined(best, found.place, kStep / 2, kExactPlace,
                   [&](double place) { return with(place, rate); });
  }
  const double rate = best.change.rate;
  if (rate > kSlowest && rate < kFastest) Offer(best);
}

/// Tries drifts of each joint. The columns of a drift are right for small turns: those of a large
/// drift begin near it.
void Hypotheses::TryDrift() {
  constexpr double kMost = 1, kStep = 0.2;  // rad in the log
  Hypothesis best = WithChange({Change::kDrift});
  if (best.change.kind != Change::kDrift) return;
  const auto thin_misfit = [&](const Hypothesis& h) {
    return FitOf(h, EquationsOf(thin_, h)).misfit();
  };
  const Hypothesis none = best;
  double least = thin_misfit(none);
  for (const int joint : {0, 1}) {
    for (double turn = -kMost; turn < kMost + kStep / 2; turn += kStep) {
      Hypothesis next = none;
      next.angles.turn[joint] = turn;
      const double misfit = thin_misfit(next);
      if (misfit >= least) continue;
      least = misfit;
      best = next;
    }
  }
  best.fit = FitOf(best, EquationsOf(best));
  Offer(Turned(best));
}

}  // namespace upswing::machine
