#include "loop/estimator.h"

#include <algorithm>
#include <cmath>

namespace upswing {
namespace {

// Gains of a critically damped observer of constant velocity: α² / (2 - α).
constexpr double kAlpha = 0.5, kBeta = kAlpha * kAlpha / (2 - kAlpha);
constexpr double kKept = 0.1;        // time for which sent torques are kept, s
constexpr double kLongestGap = 0.1;  // s; after it the observer begins again
constexpr int kMostKept = 512;       // torques sent in kKept and the longest delay, at 1 kHz

}  // namespace

Estimator::Estimator(const MachineSensors& sensors, double period)
    : sensors_(sensors), period_(period), velocity_(sensors) {}

Estimator::Estimator(const Twin& twin, double period) : Estimator(twin.sensors, period) {
  const double delay = std::max(twin.actuator.delay, 0.0);
  model_.emplace(Model{BodyOf(twin), Drive(delay, twin.actuator.lag),
                       std::max(-twin.actuator.delay, 0.0), delay + twin.actuator.lag, 0});
  model_->hanging = -model_->body.At({}).energy;
  // The drive's memory grows now, not in the loop.
  for (int i = kMostKept; i > 0; --i) model_->drive.Add(-1 - i * 1e-3, {});
}

PendulumState Estimator::Follow(PendulumState state, double begin, double seconds) const {
  const Model& m = *model_;
  const int steps = MotionSteps(seconds);
  const double h = seconds / steps;
  if (h <= 0) return state;
  int cursor = 0;
  Joints acceleration = m.body.Acceleration(state, m.drive.At(begin, cursor));
  for (int i = 0; i < steps; ++i) {
    state = StepMotion(m.body, m.drive, state, begin + i * h, h, cursor, acceleration);
  }
  return state;
}

void Estimator::Correct(const PendulumState& seen, double moment) {
  const double h = moment - time_;
  if (!begun_ || h > kLongestGap) {
    observed_ = seen;
  } else if (h > 0) {
    const PendulumState predicted = Follow(observed_, time_, h);
    const double e1 = seen.q1 - predicted.q1, e2 = seen.q2 - predicted.q2;
    const double rate = kBeta / std::max(h, period_ / 2);
    observed_ = {predicted.q1 + kAlpha * e1, predicted.q2 + kAlpha * e2, predicted.w1 + rate * e1,
                 predicted.w2 + rate * e2};
  } else {
    return;
  }
  begun_ = true;
  time_ = moment;
}

void Estimator::Update(double time, const Joints& sent, const LinkReading* reading) {
  PendulumState seen;
  if (reading != nullptr) {
    seen.q1 = reading->angle[0] - sensors_.zero1;
    seen.q2 = reading->angle[1] - sensors_.zero2;
  }
  if (!model_) {
    if (reading == nullptr) return;
    const Joints w = velocity_.Update(reading->time, {seen.q1, seen.q2});
    now_ = ahead_ = {seen.q1, seen.q2, w[0], w[1]};
    return;
  }
  model_->drive.Forget(time - kKept);
  model_->drive.Add(time, sent);
  if (reading != nullptr) Correct(seen, reading->time - model_->age);
  if (!begun_) return;
  now_ = Follow(observed_, time_, std::clamp(time - time_, 0.0, kKept));
  ahead_ = Follow(now_, time, period_ + model_->horizon);
}

double Estimator::energy() const {
  return model_ ? 1 + model_->body.At(now_).energy / model_->hanging : 0;
}

}  // namespace upswing
