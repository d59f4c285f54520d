#include "extras/machine/drive/estimator.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace upswing::machine {
namespace {

// Velocities, noise and times are for UsualPlant, and count by the scale of the twin.
//
// Noise of the velocities, which stands for unmodelled torques, rad/s/√s: usually, and while a push
// or static friction may act.
constexpr double kVelocityNoise = 0.5, kDisturbedNoise = 4;
constexpr double kMoving = 0.1;  // rad/s; static friction may hold slower links
// Limits of the normalized innovations and of their mean, in standard deviations. They are tuned on
// RealAIGym's logs and in simulation, because the noise of the angles is a bound.
constexpr double kOutlier = 3, kLargestMean = 2;
constexpr double kInnovationTime = 0.025;  // time constant of this mean, s
constexpr double kInnovationCycles = 2;    // least of it
constexpr double kFirstVelocity = 3;       // deviation of the velocities at the beginning, rad/s
constexpr double kLeastNoise = 1e-6;       // of the measured angles, rad
constexpr double kKept = 0.1;              // time for which sent torques are kept, s
constexpr double kLongestGap = 0.1;        // s; after it the filter begins again
constexpr double kMostKept = 512;          // torques sent in kKept and the longest delay, at 1 kHz
constexpr double kStiction = 1.5;          // friction of a joint without motion, of dry friction
constexpr double kLongestUnseen = 0.4;     // time for which a motion is predicted without sight, s

double Square(double x) { return x * x; }

PendulumState StateOf(const Eigen::Matrix<double, 10, 1>& x) { return {x[0], x[1], x[2], x[3]}; }

}  // namespace

Estimator::Estimator(const MachineSensors& sensors, double period)
    : sensors_(sensors), period_(period), latency_(period), velocity_(sensors) {
  track_.x[kZero] = sensors.zero1;
  track_.x[kZero + 1] = sensors.zero2;
}

Estimator::Estimator(const Twin& twin, double period, StateSource source)
    : Estimator(twin.sensors, period) {
  source_ = source;
  const Actuator& motor = twin.actuator;
  const Drive drive(motor.delay, motor.lag);
  const Scale scale = ScaleOverUsual(twin.plant);
  const bool has_offset = CovarianceOf(twin, "torque_offset1", "torque_offset1") > 0 ||
                          CovarianceOf(twin, "torque_offset2", "torque_offset2") > 0;
  model_.emplace(Model{BodyOf(twin), drive, drive, scale, has_offset, motor.delay + motor.lag, 0});
  model_->hanging = -model_->body.At({}).energy;
  // The drives' memory grows now, not in the loop.
  const int kept = static_cast<int>(kMostKept * std::max(1.0, scale.time));
  for (int i = kept; i > 0; --i) model_->drive.Add(-1 - i * 1e-3, {});
  model_->silent = model_->drive;
  // A fit knows the sum of delay and lag better than each.
  expectation_.delay_deviation = std::sqrt(
      std::max(0.0, CovarianceOf(twin, "delay", "delay") + CovarianceOf(twin, "lag", "lag") +
                        2 * CovarianceOf(twin, "delay", "lag")));
  expectation_.friction_deviation = {
      std::numbers::pi / 2 * std::sqrt(CovarianceOf(twin, "coulomb1", "coulomb1")),
      std::numbers::pi / 2 * std::sqrt(CovarianceOf(twin, "coulomb2", "coulomb2"))};

  Vector& x = track_.x;
  Matrix& P = track_.P;
  x[kFriction] = model_->body.f1;
  x[kFriction + 1] = model_->body.f2;
  x[kOffset] = motor.torque_offset1;
  x[kOffset + 1] = motor.torque_offset2;
  shown_friction_ = friction();
  constexpr std::array kNames{"zero1",    "zero2",          "coulomb1",
                              "coulomb2", "torque_offset1", "torque_offset2"};
  constexpr int kUncertain = kStates - kZero;
  static_assert(kNames.size() == kUncertain);
  for (int i = 0; i < kUncertain; ++i) {
    for (int j = 0; j < kUncertain; ++j) {
      P(kZero + i, kZero + j) = CovarianceOf(twin, kNames[i], kNames[j]);
    }
  }
}

double Estimator::InnovationTime() const {
  return std::max(Time(kInnovationTime), std::min(kInnovationTime, kInnovationCycles * period_));
}

double Estimator::VelocityNoise(bool disturbed) const {
  return Velocity(disturbed ? kDisturbedNoise : kVelocityNoise) / std::sqrt(model_->scale.time);
}

Estimator::Vector Estimator::Follow(const Drive& drive, Vector x, double begin,
                                    double seconds) const {
  Body body = model_->body;
  const int steps = MotionSteps(body, seconds);
  const double h = seconds / steps;
  if (h <= 0) return x;
  body.f1 = x[kFriction];
  body.f2 = x[kFriction + 1];
  body.offset = {x[kOffset], x[kOffset + 1]};
  body.cogging.SetZero({x[kZero], x[kZero + 1]});
  MotionIntegrator integrator(body, drive);
  MotionPoint point = integrator.Start(begin, StateOf(x));
  for (int i = 0; i < steps; ++i) {
    point.time = begin + i * h;  // a sum of steps would have rounding errors
    point = integrator.Step(point, h);
  }
  const PendulumState& end = point.state;
  x.head<4>() << end.q1, end.q2, end.w1, end.w2;
  return x;
}

double Estimator::AngleNoise() const {
  // Rounding errors of a slow joint repeat, so the noise is a whole quantum.
  return std::max(sensors_.quantum, kLeastNoise);
}

void Estimator::Begin(const Joints& angle, double moment) {
  Vector& x = track_.x;
  Matrix& P = track_.P;
  begin_ = track_.time = disturbed_until_ = moment;
  mean_innovation_.setZero();
  // Angle = measured angle - zero, so their errors are opposite.
  for (int j = 0; j < 2; ++j) x[kAngle + j] = angle[j] - x[kZero + j];
  x.segment<2>(kVelocity).setZero();
  P.topRows<4>().setZero();
  P.leftCols<4>().setZero();
  P.topRows<2>() = -P.middleRows<2>(kZero);
  P.leftCols<2>() = -P.middleCols<2>(kZero);
  P.diagonal().head<2>().array() += Square(AngleNoise());
  P.diagonal().segment<2>(kVelocity).setConstant(Square(Velocity(kFirstVelocity)));
}

void Estimator::Predict(Track& track, double seconds, double noise) const {
  const Drive& drive = model_->drive;
  const Vector next = Follow(drive, track.x, track.time, seconds);
  // Without cogging, the zeros have no effect on the motion: their columns are those of the
  // identity.
  Matrix F = Matrix::Identity();
  constexpr double kStep = 1e-6;  // in natural units
  const Scale& scale = model_->scale;
  Vector step = Vector::Constant(kStep);
  step.segment<2>(kVelocity) *= scale.velocity();
  step.tail<kStates - kFriction>() *= scale.torque;
  for (int i = 0; i < kStates; ++i) {
    if (i / 2 == kZero / 2 && !model_->body.cogging.any()) continue;
    if (i >= kOffset && !model_->has_offset) continue;
    Vector other = track.x;
    other[i] += step[i];
    F.col(i) = (Follow(drive, other, track.time, seconds) - next) / step[i];
  }
  track.P = F * track.P * F.transpose();
  track.P.diagonal().segment<2>(kVelocity).array() += Square(noise) * seconds;
  track.x = next;
  track.time += seconds;
}

Eigen::Vector2d Estimator::Correct(Track& track, const Joints& angle, const Encoders& encoders,
                                   double limit) const {
  Vector& x = track.x;
  Matrix& P = track.P;
  Eigen::Matrix<double, 2, kStates> H = Eigen::Matrix<double, 2, kStates>::Zero();
  Eigen::Vector2d innovation = Eigen::Vector2d::Zero();
  for (int j = 0; j < 2; ++j) {
    if (!encoders[j]) continue;  // a row of zeros corrects nothing
    H(j, kAngle + j) = H(j, kZero + j) = 1;
    innovation[j] = angle[j] - H.row(j) * x;
  }
  Eigen::Matrix2d S = H * P * H.transpose();
  S.diagonal().array() += Square(AngleNoise());
  const Eigen::LLT<Eigen::Matrix2d> factor(S);
  const Eigen::Matrix<double, kStates, 2> K = factor.solve(H * P).transpose();
  const Eigen::Vector2d normalized =
      factor.matrixL().solve(innovation).cwiseMin(limit).cwiseMax(-limit);
  x += K * (factor.matrixL() * normalized);
  x.segment<2>(kFriction) = x.segment<2>(kFriction).cwiseMax(0);  // friction never drives
  P -= K * H * P;
  P = (0.5 * (P + P.transpose())).eval();
  return normalized;
}

void Estimator::NoticePush(const Eigen::Vector2d& normalized, double seconds) {
  // While the model holds, normalized innovations are white. A push gives many of them the same
  // sign, so their mean exceeds that of white ones, whose variance is weight / (2 - weight).
  const double weight = std::min(seconds / InnovationTime(), 1.0);
  mean_innovation_ += weight * (normalized - mean_innovation_);
  if (mean_innovation_.squaredNorm() > Square(kLargestMean) * weight / (2 - weight)) {
    disturbed_until_ = track_.time + InnovationTime();
  }
}

bool Estimator::Slow(const Track& track) const {
  return track.x.segment<2>(kVelocity).cwiseAbs().maxCoeff() < Velocity(kMoving);
}

void Estimator::Take(const TimedReading& reading, bool driven) {
  const double seconds = reading.time - track_.time;
  expectation_.innovation = {};
  expectation_.gap = 0;
  if (!begin_ || std::abs(seconds) > LinkTime(kLongestGap)) {
    Begin(reading.angle, reading.time);
    return;
  }
  if (seconds <= 0) return;
  const Track before = track_;
  // A gap that is long for a small machine leaves time for a push.
  const bool was_blind = seconds > Time(kLongestGap);
  const bool disturbed = track_.time < disturbed_until_ || Slow(track_) || was_blind;
  Predict(track_, seconds, VelocityNoise(disturbed));
  for (int j = 0; j < 2; ++j) {
    expectation_.innovation[j] = reading.angle[j] - track_.x[kAngle + j] - track_.x[kZero + j];
  }
  expectation_.gap = seconds;
  // Readings with a wrong time have large innovations. At the beginning, and after such a gap, so
  // have right ones.
  const bool begins = track_.time < *begin_ + InnovationTime();
  const double limit = begins || was_blind ? 1e9 : kOutlier;
  NoticePush(Correct(track_, reading.angle, {true, true}, limit), seconds);
  if (driven || !Slow(track_)) return;
  // Links may rest for minutes, held off their equilibrium: nothing is learned.
  track_ = before;
  Begin(reading.angle, reading.time);
}

void Estimator::BeginUnseen(int joint, double angle) {
  unseen_[joint] = track_;
  unseen_[joint].x[kFriction + joint] = kStiction * shown_friction_[joint];
  unseen_begin_[joint] = track_.time;
  unseen_angle_[joint] = track_.x[kAngle + joint] + track_.x[kZero + joint];
  shown_[joint] = angle;
}

void Estimator::ExpectUnseen(const TimedReading& reading) {
  Encoders visible{};
  for (int j = 0; j < 2; ++j) {
    const bool begins =
        track_.time == *begin_ || track_.time > unseen_begin_[j] + Time(kLongestUnseen);
    visible[j] = std::abs(reading.angle[j] - shown_[j]) > kVisibleSteps * AngleNoise();
    // A filter that sees no motion takes it for friction.
    if (visible[j]) shown_friction_[j] = friction()[j];
    if (begins || visible[j]) BeginUnseen(j, reading.angle[j]);
  }
  for (int j = 0; j < 2; ++j) {
    Track& track = unseen_[j];
    const double seconds = reading.time - track.time;
    if (seconds > 0) {
      // Static friction may hold slow links. An encoder without visible motion does not correct the
      // other joint.
      Predict(track, seconds, VelocityNoise(Slow(track)));
      Encoders others = visible;
      others[j] = false;
      Correct(track, reading.angle, others, kOutlier);
    }
    const int q = kAngle + j, z = kZero + j;
    const Matrix& P = track.P;
    expectation_.unseen[j] = track.x[q] + track.x[z] - unseen_angle_[j];
    expectation_.deviation[j] = std::sqrt(std::max(P(q, q) + 2 * P(q, z) + P(z, z), 0.0));
  }
}

void Estimator::ExpectResponse(const TimedReading& reading, bool driven) {
  if (!driven) {
    driven_ = coasting_ = track_.x;
    response_begin_ = response_time_ = track_.time;
    response_angle_ = reading.angle;
    model_->silent = model_->drive;
  }
  const double seconds = reading.time - response_time_;
  if (seconds > 0 && reading.time < response_begin_ + Time(kResponseSeconds)) {
    driven_ = Follow(model_->drive, driven_, response_time_, seconds);
    coasting_ = Follow(model_->silent, coasting_, response_time_, seconds);
    response_time_ = reading.time;
  }
  for (int j = 0; j < 2; ++j) {
    expectation_.measured[j] = reading.angle[j] - response_angle_[j];
    expectation_.driven[j] = driven_[kAngle + j] + driven_[kZero + j] - response_angle_[j];
    expectation_.coasting[j] = coasting_[kAngle + j] + coasting_[kZero + j] - response_angle_[j];
  }
}

Joints Estimator::zero() const {
  if (source_ == StateSource::kDifferences) return {sensors_.zero1, sensors_.zero2};
  return {track_.x[kZero], track_.x[kZero + 1]};
}

void Estimator::Send(double time, const Joints& torque) {
  sent_ = torque;
  if (!model_) return;
  model_->drive.Forget(time - LinkTime(kKept));
  model_->drive.Add(time, torque);
}

void Estimator::Update(double time, const TimedReading* reading) {
  if (source_ == StateSource::kDifferences && reading != nullptr) {
    const Joints q{reading->angle[0] - sensors_.zero1, reading->angle[1] - sensors_.zero2};
    const Joints w = velocity_.Update(reading->time, q);
    now_ = ahead_ = {q[0], q[1], w[0], w[1]};
  }
  if (!model_) return;
  if (reading != nullptr && std::isfinite(reading->angle[0] + reading->angle[1])) {
    const bool driven = sent_ != Joints{};
    Take(*reading, driven);
    ExpectUnseen(*reading);
    ExpectResponse(*reading, driven);
    expectation_.known = true;
    for (int j = 0; j < 2; ++j)
      expectation_.friction[j] = std::numbers::pi / 2 * shown_friction_[j];
  }
  if (!begin_ || source_ == StateSource::kDifferences) return;
  const Drive& drive = model_->drive;
  const Vector now =
      Follow(drive, track_.x, track_.time, std::clamp(time - track_.time, 0.0, LinkTime(kKept)));
  now_ = StateOf(now);
  ahead_ = StateOf(Follow(drive, now, time, latency_ + model_->horizon));
}

Joints Estimator::CompensationTorque(double share) const {
  return {DryFriction(share * friction()[0], ahead_.w1) - share * offset()[0],
          DryFriction(share * friction()[1], ahead_.w2) - share * offset()[1]};
}

double Estimator::energy() const {
  return model_ ? 1 + model_->body.At(now_).energy / model_->hanging : 0;
}

}  // namespace upswing::machine
