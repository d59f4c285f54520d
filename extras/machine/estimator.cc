#include "extras/machine/estimator.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace upswing::machine {
namespace {

// Noise of the velocities, which stands for unmodelled torques, rad/s/√s: usually, and while a push
// or static friction may act.
constexpr double kVelocityNoise = 0.5, kDisturbedNoise = 4;
constexpr double kMoving = 0.1;  // rad/s; static friction may hold slower links
// Limits of the normalized innovations and of their mean, in standard deviations. They are tuned on
// RealAIGym's logs and in simulation, because the noise of the angles is a bound.
constexpr double kOutlier = 3, kLargestMean = 2;
constexpr double kInnovationTime = 0.025;  // time constant of this mean, s
constexpr double kFirstVelocity = 3;       // deviation of the velocities at the beginning, rad/s
constexpr double kLeastNoise = 1e-6;       // of the measured angles, rad
constexpr double kKept = 0.1;              // time for which sent torques are kept, s
constexpr double kLongestGap = 0.1;        // s; after it the filter begins again
constexpr int kMostKept = 512;             // torques sent in kKept and the longest delay, at 1 kHz

double Square(double x) { return x * x; }

PendulumState StateOf(const Eigen::Matrix<double, 8, 1>& x) { return {x[0], x[1], x[2], x[3]}; }

}  // namespace

Estimator::Estimator(const MachineSensors& sensors, double period)
    : sensors_(sensors), period_(period), velocity_(sensors) {
  x_[kZero] = sensors.zero1;
  x_[kZero + 1] = sensors.zero2;
}

Estimator::Estimator(const Twin& twin, double period) : Estimator(twin.sensors, period) {
  const Actuator& motor = twin.actuator;
  model_.emplace(Model{BodyOf(twin), Drive(motor.delay, motor.lag), motor.delay + motor.lag, 0});
  model_->hanging = -model_->body.At({}).energy;
  // The drive's memory grows now, not in the loop.
  for (int i = kMostKept; i > 0; --i) model_->drive.Add(-1 - i * 1e-3, {});

  x_[kFriction] = model_->body.f1;
  x_[kFriction + 1] = model_->body.f2;
  constexpr std::array kNames{"zero1", "zero2", "coulomb1", "coulomb2"};
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) P_(kZero + i, kZero + j) = CovarianceOf(twin, kNames[i], kNames[j]);
  }
}

Estimator::Vector Estimator::Follow(Vector x, double begin, double seconds) const {
  const int steps = MotionSteps(seconds);
  const double h = seconds / steps;
  if (h <= 0) return x;
  Manipulator body = model_->body;
  body.f1 = x[kFriction];
  body.f2 = x[kFriction + 1];
  PendulumState state = StateOf(x);
  int cursor = 0;
  Joints acceleration = body.Acceleration(state, model_->drive.At(begin, cursor));
  for (int i = 0; i < steps; ++i) {
    state = StepMotion(body, model_->drive, state, begin + i * h, h, cursor, acceleration);
  }
  x.head<4>() << state.q1, state.q2, state.w1, state.w2;
  return x;
}

double Estimator::AngleNoise() const {
  // Rounding errors of a slow joint repeat, so the noise is a whole quantum.
  return std::max(sensors_.quantum, kLeastNoise);
}

void Estimator::Begin(const Joints& angle, double moment) {
  begin_ = time_ = disturbed_until_ = moment;
  mean_innovation_.setZero();
  // Angle = measured angle - zero, so their errors are opposite.
  for (int j = 0; j < 2; ++j) x_[kAngle + j] = angle[j] - x_[kZero + j];
  x_.segment<2>(kVelocity).setZero();
  P_.topRows<4>().setZero();
  P_.leftCols<4>().setZero();
  P_.topRows<2>() = -P_.middleRows<2>(kZero);
  P_.leftCols<2>() = -P_.middleCols<2>(kZero);
  P_.diagonal().head<2>().array() += Square(AngleNoise());
  P_.diagonal().segment<2>(kVelocity).setConstant(Square(kFirstVelocity));
}

void Estimator::Predict(double seconds) {
  const Vector next = Follow(x_, time_, seconds);
  // The zeros have no effect on the motion: their columns are those of the identity.
  Matrix F = Matrix::Identity();
  constexpr double kStep = 1e-6;
  for (const int i : {0, 1, 2, 3, kFriction, kFriction + 1}) {
    Vector other = x_;
    other[i] += kStep;
    F.col(i) = (Follow(other, time_, seconds) - next) / kStep;
  }
  P_ = F * P_ * F.transpose();
  const bool disturbed = time_ < disturbed_until_ || Slow();
  const double noise = disturbed ? kDisturbedNoise : kVelocityNoise;
  P_.diagonal().segment<2>(kVelocity).array() += Square(noise) * seconds;
  x_ = next;
  time_ += seconds;
}

void Estimator::Correct(const Joints& angle, double seconds) {
  Eigen::Matrix<double, 2, kStates> H = Eigen::Matrix<double, 2, kStates>::Zero();
  H(0, kAngle) = H(1, kAngle + 1) = H(0, kZero) = H(1, kZero + 1) = 1;
  const Eigen::Vector2d innovation = Eigen::Vector2d(angle[0], angle[1]) - H * x_;
  Eigen::Matrix2d S = H * P_ * H.transpose();
  S.diagonal().array() += Square(AngleNoise());
  const Eigen::LLT<Eigen::Matrix2d> factor(S);
  const Eigen::Matrix<double, kStates, 2> K = factor.solve(H * P_).transpose();
  // Readings with a wrong time have large innovations. At the beginning, so have right ones.
  const double limit = time_ < *begin_ + kInnovationTime ? 1e9 : kOutlier;
  const Eigen::Vector2d normalized =
      factor.matrixL().solve(innovation).cwiseMin(limit).cwiseMax(-limit);
  x_ += K * (factor.matrixL() * normalized);
  x_.tail<2>() = x_.tail<2>().cwiseMax(0);  // friction never drives
  P_ -= K * H * P_;
  P_ = (0.5 * (P_ + P_.transpose())).eval();

  // While the model holds, normalized innovations are white. A push gives many of them the same
  // sign, so their mean exceeds that of white ones, whose variance is weight / (2 - weight).
  const double weight = std::min(seconds / kInnovationTime, 1.0);
  mean_innovation_ += weight * (normalized - mean_innovation_);
  if (mean_innovation_.squaredNorm() > Square(kLargestMean) * weight / (2 - weight)) {
    disturbed_until_ = time_ + kInnovationTime;
  }
}

bool Estimator::Slow() const { return x_.segment<2>(kVelocity).cwiseAbs().maxCoeff() < kMoving; }

void Estimator::Take(const TimedReading& reading, bool driven) {
  const double seconds = reading.time - time_;
  if (!begin_ || std::abs(seconds) > kLongestGap) {
    Begin(reading.angle, reading.time);
    return;
  }
  if (seconds <= 0) return;
  const Vector x = x_;
  const Matrix P = P_;
  Predict(seconds);
  Correct(reading.angle, seconds);
  if (driven || !Slow()) return;
  // Links may rest for minutes, held off their equilibrium: nothing is learned.
  x_ = x;
  P_ = P;
  Begin(reading.angle, reading.time);
}

void Estimator::Update(double time, const Joints& sent, const TimedReading* reading) {
  if (!model_) {
    if (reading == nullptr) return;
    const Joints q{reading->angle[0] - x_[kZero], reading->angle[1] - x_[kZero + 1]};
    const Joints w = velocity_.Update(reading->time, q);
    now_ = ahead_ = {q[0], q[1], w[0], w[1]};
    return;
  }
  model_->drive.Forget(time - kKept);
  model_->drive.Add(time, sent);
  if (reading != nullptr && std::isfinite(reading->angle[0] + reading->angle[1])) {
    Take(*reading, sent != Joints{});
  }
  if (!begin_) return;
  const Vector now = Follow(x_, time_, std::clamp(time - time_, 0.0, kKept));
  now_ = StateOf(now);
  ahead_ = StateOf(Follow(now, time, period_ + model_->horizon));
}

Joints Estimator::CompensationTorque(double share) const {
  return {DryFriction(share * x_[kFriction], ahead_.w1),
          DryFriction(share * x_[kFriction + 1], ahead_.w2)};
}

double Estimator::energy() const {
  return model_ ? 1 + model_->body.At(now_).energy / model_->hanging : 0;
}

}  // namespace upswing::machine
