#include "extras/machine/drive/earned_torque.h"

#include <algorithm>
#include <cmath>

namespace upswing::machine {
namespace {

constexpr double kLeastStep = 1e-5;  // of encoders of an unknown step, rad; 20 bits per turn
// Times are for UsualPlant, and count by the scale of the machine.
constexpr double kQuietSeconds = 0.3;  // window of the readings that show whether links rest
// Range of the readings at rest, rad. A twin knows how slow links go on.
constexpr double kQuietAngle = 0.004, kPredictedQuietAngle = 0.03;

// The pulse.
constexpr double kFirstShare = 0.01;     // of the limit
constexpr double kDoubling = 0.025;      // time in which the torque doubles, s
constexpr double kSlowDoubling = 0.1;    // the same once the motor's joint has answered, s
constexpr double kLimitSeconds = 0.04;   // time at the limit in which the joints have to answer, s
constexpr double kDragSeconds = 0.5;     // the same for the other joint, s
constexpr double kLargestTravel = 0.5;   // of the motor's joint until the other one answers, rad
constexpr double kLongestBlind = 0.025;  // age of a reading with which a pulse goes on, s
// Least times in cycles, none longer than the times above at 100 Hz.
constexpr double kDoublingCycles = 2, kLimitCycles = 4, kBlindCycles = 2.5;

// Motion that the twin predicts for a pulse before it is compared.
constexpr double kCompared = 0.03, kComparedSteps = 12;  // rad, steps
constexpr double kLeastCompared = 0.4;  // share of it that is compared under the largest torque
constexpr double kLeastShare = 0.4, kLargestShare = 1.6;  // of this motion that an encoder may show
constexpr double kDelayDeviations = 2;                    // of the twin's delay and lag
// Least torque of the pulse, of dry friction: of the twin's, and of the largest that is probable.
constexpr double kAboveFriction = 3, kAboveProbable = 2;
constexpr double kFrictionDeviations = 2;  // of the twin's friction

// Motion that an encoder must have shown.
constexpr double kDeviations = 4;      // of the twin's prediction
constexpr double kLeastUnseen = 0.02;  // rad
constexpr int kUnseenReadings = 2;
constexpr double kBlockMotion = 0.25, kBlockSteps = 30;  // rad, steps
constexpr double kBlockFriction = 2;                     // of the torque that first moved the joint
constexpr double kOtherTravel = 5;  // rad; friction may hold a light link while the other one turns

// Torques, of dry friction, that surely hold or move links at rest.
constexpr double kSurelyHeld = 0.8, kSurelyMoves = 2;
constexpr double kStillSeconds = 0.25;  // time without visible motion after which links rest, s
constexpr double kStillMotion = 0.1;    // motion of the twin that has to be seen then, rad
constexpr double kLongestHeld = 0.5;    // s

// The block of a joint that has not answered a pulse: the limit moves it by 0.1 rad in 0.1 s.
constexpr double kUsualMass = 0.05, kUsualFriction = 0.2;  // s², of the torque's limit

}  // namespace

EarnedTorque::EarnedTorque(const EarnedTorqueConfig& config)
    : config_(config),
      block_{.mass = kUsualMass * config.scale.time * config.scale.time * config.limit,
             .friction = kUsualFriction * config.limit},
      proven_(!config.hangs || config.limit <= 0),
      motor_(config.actuated_joint - 1) {
  for (Joint& joint : joints_) joint.step = config.quantum > 0 ? config.quantum : kUnknownStep;
}

double EarnedTorque::Time(double usual, double cycles) const {
  return std::max(Time(usual), std::min(usual, cycles * seen_.period));
}

double EarnedTorque::Visible(const Joint& joint) const {
  return std::max(kVisibleSteps * joint.step, 2 * joint.range);
}

void EarnedTorque::See(const Cycle& cycle, const Joints& sent) {
  seen_ = cycle;
  for (int j = 0; j < 2; ++j) {
    Joint& joint = joints_[j];
    const double change = std::abs(cycle.angle[j] - joint.angle);
    if (has_seen_ && config_.quantum <= 0 && change > kLeastStep) {
      joint.step = std::min(joint.step, change);
    }
    joint.angle = cycle.angle[j];
    if (!has_seen_) joint.lowest = joint.highest = joint.angle;
    joint.lowest = std::min(joint.lowest, joint.angle);
    joint.highest = std::max(joint.highest, joint.angle);
    if (!has_seen_ || std::abs(joint.angle - joint.shown) > kVisibleSteps * joint.step) {
      joint.shown = joint.angle;
      joint.other = cycle.angle[1 - j];
      joint.shown_at = cycle.time;
      if (j == motor_) block_.moved = block_.velocity = 0;
    } else if (j == motor_) {
      MoveBlock(sent[j]);
    }
  }
  if (!has_seen_) window_begin_ = cycle.time;
  has_seen_ = true;
  if (phase_ == Phase::kRest && cycle.time >= window_begin_ + Time(kQuietSeconds)) JudgeRest();
}

void EarnedTorque::JudgeRest() {
  quiet_ = true;
  const double angle = PredictsPulse() ? kPredictedQuietAngle : kQuietAngle;
  for (Joint& joint : joints_) {
    joint.range = joint.highest - joint.lowest;
    const bool rests = joint.range <= std::max(kVisibleSteps * joint.step, angle);
    if (!rests) quiet_ = false;
    joint.lowest = joint.highest = joint.angle;
  }
  window_begin_ = seen_.time;
}

void EarnedTorque::MoveBlock(double torque) {
  // Friction acts against the motion, or holds the block.
  const double before = block_.velocity;
  const double held = std::copysign(block_.friction, before != 0 ? before : torque);
  const bool rests = before == 0 && std::abs(torque) <= block_.friction;
  if (!rests) block_.velocity += (torque - held) / block_.mass * seen_.period;
  if (before * block_.velocity < 0) block_.velocity = 0;
  block_.moved += block_.velocity * seen_.period;
}

void EarnedTorque::CountGap(double now) {
  constexpr double kGapCycles = 1.5;
  if (push_.time < 0) return;
  const double beyond = now - push_.time - seen_.period;  // s
  if (beyond < (kGapCycles - 1) * seen_.period) return;
  impulse_ += push_.torque * beyond;
  if (phase_ != Phase::kPush) return;
  travel_ += impulse_ * beyond;
  if (amplitude_ == config_.limit) at_limit_ += beyond;
}

Joints EarnedTorque::Pulse(double now, double age) {
  Joints torque{};
  CountGap(now);
  push_ = {0, now};
  if (proven_ || age > Time(kLongestBlind, kBlindCycles)) return torque;
  const double limit = config_.limit;
  if (phase_ == Phase::kRest) {
    phase_ = Phase::kPush;
    amplitude_ = kFirstShare * limit;
    for (Joint& joint : joints_) joint.start = joint.angle;
  } else if (phase_ == Phase::kPush && Answered()) {
    phase_ = Phase::kStop;
  } else if (phase_ == Phase::kPush) {
    // Without a twin, the other joint may have to be dragged along by friction.
    const bool drags = !PredictsPulse() && joints_[motor_].answered;
    const double doubling = drags ? Time(kSlowDoubling) : Time(kDoubling, kDoublingCycles);
    amplitude_ = std::min(amplitude_ * std::exp2(seen_.period / doubling), limit);
    if (amplitude_ == limit) at_limit_ += seen_.period;
  }
  if (phase_ == Phase::kPush) {
    impulse_ += amplitude_ * seen_.period;
    travel_ += impulse_ * seen_.period;
    torque[motor_] = amplitude_;
  } else if (impulse_ > 0) {
    torque[motor_] = -std::min(amplitude_, impulse_ / seen_.period);
    impulse_ += torque[motor_] * seen_.period;
  } else {
    proven_ = true;
  }
  push_.torque = torque[motor_];
  return torque;
}

Complaint EarnedTorque::JudgePulse() {
  if (phase_ != Phase::kPush) return {};
  for (int j = 0; j < 2; ++j) {
    if (joints_[j].answered) continue;
    if (const Complaint complaint = JudgeJoint(j)) return complaint;
  }
  return {};
}

/// Judges a joint that has not answered yet.
Complaint EarnedTorque::JudgeJoint(int j) {
  return PredictsPulse() ? JudgeShare(j) : JudgeMotion(j);
}

/// Judges whether an encoder shows any motion of its joint.
Complaint EarnedTorque::JudgeMotion(int j) {
  Joint& joint = joints_[j];
  if (std::abs(joint.angle - joint.start) > Visible(joint)) {
    joint.answered = true;
    if (j != motor_) return {};
    return JudgeDirection(j);
  }
  const auto number = static_cast<double>(j + 1);
  if (j == motor_) {
    if (at_limit_ <= Time(kLimitSeconds, kLimitCycles)) return {};
    return {
        "joint %.0f does not answer its motor: no motion with up to %.3g N·m. Are the motor and "
        "the encoder connected, does anything hold the joint?",
        {number, amplitude_}};
  }
  // Once it moves, the motor's joint drags the other one along.
  const Joint& pushed = joints_[motor_];
  const bool travelled = std::abs(pushed.angle - pushed.start) > kLargestTravel;
  if (!travelled && at_limit_ <= Time(kDragSeconds)) return {};
  return {
      "joint %.0f does not answer: no motion after the other one has turned, with up to %.3g N·m. "
      "Is its encoder connected, does anything hold the joint?",
      {number, amplitude_}};
}

/// Judges the first visible motion of the motor's joint, without a twin.
Complaint EarnedTorque::JudgeDirection(int j) {
  const Joint& joint = joints_[j];
  const double motion = joint.angle - joint.start;
  block_.friction = kBlockFriction * amplitude_;  // gravity may hold the joint, too
  block_.mass = travel_ / std::abs(motion);
  if (motion > 0) return {};
  return {
      "joint %.0f moves by %.3g rad under %.3g N·m: is the sign of its motor or encoder wrong, are "
      "the joints swapped?",
      {static_cast<double>(j + 1), motion, amplitude_}};
}

/// The torque (N·m) of the pulse with which friction no longer decides whether joint j moves.
double EarnedTorque::LeastTorque(int j) const {
  const Expectation& e = seen_.expected;
  const auto probable = [&](int joint) {
    return e.friction[joint] + kFrictionDeviations * e.friction_deviation[joint];
  };
  return std::max({kAboveFriction * e.friction[motor_], kAboveProbable * probable(motor_),
                   kAboveProbable * probable(j)});
}

/// Judges the share of the twin's motion that an encoder shows.
Complaint EarnedTorque::JudgeShare(int j) {
  const Expectation& e = seen_.expected;
  Joint& joint = joints_[j];
  const double expected = e.driven[j] - e.coasting[j], shown = e.measured[j] - e.coasting[j];
  // While the torque doubles, a delay that differs from the twin's is another torque. A late
  // machine, too, has to move far enough to be compared.
  const double doublings = kDelayDeviations * e.delay_deviation / Time(kDoubling, kDoublingCycles);
  const double unsure = std::exp2(doublings);
  const double enough = unsure * std::max(kCompared, kComparedSteps * joint.step);
  const bool last = at_limit_ > Time(kLimitSeconds, kLimitCycles);
  const bool strong = amplitude_ > LeastTorque(j);
  if (!last && (std::abs(expected) < enough || !strong)) return {};
  // The largest torque moves the joint too little to judge how far, but it has to move.
  if (std::abs(expected) < kLeastCompared * enough) return JudgeMotion(j);
  joint.answered = true;
  const double share = shown / expected;
  if (share >= kLeastShare / unsure && share <= kLargestShare * unsure) return {};
  return {
      "joint %.0f moves by %.3g rad under the first torques, and the twin by %.3g rad: are the "
      "signs, the scales and the order of motors and encoders those of the twin?",
      {static_cast<double>(j + 1), shown, expected}};
}

Complaint EarnedTorque::JudgeRun() {
  const Expectation& e = seen_.expected;
  if (held_ && seen_.time > held_at_ + Time(kLongestHeld)) {
    return {"both encoders stick, or the links are held, under torques that must move them"};
  }
  for (int j = 0; j < 2; ++j) {
    Joint& joint = joints_[j];
    const auto number = static_cast<double>(j + 1);
    if (PredictsRun()) {
      const double least =
          kDeviations * e.deviation[j] + (kVisibleSteps + 1) * joint.step + kLeastUnseen;
      if (std::abs(e.unseen[j]) > least) {
        ++joint.unseen;
      } else {
        joint.unseen = 0;
      }
      if (joint.unseen < kUnseenReadings) continue;
      return {"joint %.0f: the encoder sticks, or the joint is held: the twin moves by %.3g rad",
              {number, e.unseen[j]}};
    }
    if (j == motor_ && std::abs(block_.moved) > std::max(kBlockMotion, kBlockSteps * joint.step)) {
      return {"joint %.0f: the encoder sticks, or the joint is held, under the motor's torque",
              {number}};
    }
    const double turned = joints_[1 - j].angle - joint.other;
    if (j != motor_ && std::abs(turned) > kOtherTravel) {
      return {
          "joint %.0f: the encoder sticks, or the joint is held, while the other joint turns by "
          "%.3g rad",
          {number, turned}};
    }
  }
  return {};
}

Joints EarnedTorque::Permitted(const Joints& wanted) {
  const Expectation& e = seen_.expected;
  const double shown_at = std::max(joints_[0].shown_at, joints_[1].shown_at);
  if (!PredictsRun() || seen_.time < shown_at + Time(kStillSeconds)) {
    held_ = false;
    return wanted;
  }
  Joints permitted = wanted;
  bool moves = false;  // whether a torque must move its joint
  for (int j = 0; j < 2; ++j) {
    if (std::abs(wanted[j]) > kSurelyMoves * e.friction[j]) moves = true;
  }
  const double moved = std::max(std::abs(e.unseen[0]), std::abs(e.unseen[1]));
  if (!moves) {
    held_ = false;
  } else if (moved > kStillMotion && !held_) {
    held_ = true;
    held_at_ = seen_.time;
  }
  if (moves && !held_) return permitted;
  for (int j = 0; j < 2; ++j) {
    const double held = kSurelyHeld * e.friction[j];
    permitted[j] = std::clamp(wanted[j], -held, held);
  }
  return permitted;
}

}  // namespace upswing::machine
