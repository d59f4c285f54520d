#include "loop/supervisor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

constexpr double kSlow = 0.3;         // velocity at which braking may end, rad/s
constexpr double kLow = 0.9;          // cosine of a hanging link's angle: 26° from the vertical
constexpr double kSlowSeconds = 0.2;  // time for which the links must hang that slow
constexpr double kHardest = 1000;     // acceleration that no joint reaches, rad/s²
constexpr int kStuckReadings = 2;     // unchanged readings after a fast one: a stuck encoder
constexpr double kLargestReading = 1e6;
constexpr double kLargestStart = 100;  // rad, rad/s

bool Within(double x, double limit) { return std::abs(x) <= limit; }  // false for NaN

/// Whether both links hang slowly. Slow links that stand upright fall when the motors go off.
bool AtRest(const PendulumState& s) {
  return Within(s.w1, kSlow) && Within(s.w2, kSlow) && std::cos(s.q1) > kLow &&
         std::cos(s.q1 + s.q2) > kLow;
}

}  // namespace

void Limits::Describe(Options& o) {
  o.Section("limits");
  o.Add(&angle, "max_angle", {0.1, 1e3}, "rad", "largest angle of a joint; beyond it: braking");
  o.Add(&velocity, "max_velocity", {0.1, 1e3}, "rad/s",
        "largest velocity of a joint; beyond it: braking");
  o.Add(&torque, "max_torque", {0, 1e3}, "N·m", "largest torque; larger ones are cut");
  o.Add(&energy, "max_energy", {0.1, 1e3}, "",
        "largest mechanical energy, 0 hanging, 1 upright; beyond it: braking");
  o.Add(&age, "max_age", {0.001, 1}, "s", "largest age of the last reading; beyond it: a fault");
  o.Add(&brake_damping, "brake_damping", {0, 100}, "N·m·s/rad",
        "torque against the velocity while braking");
  o.Add(&brake_seconds, "brake_seconds", {0, 60}, "s", "longest time of braking");
  o.Add(&patience, "patience", {0.1, 3600}, "s",
        "longest wait for readings and for the start state");
}

const char* NameOf(LoopState state) {
  constexpr std::array kNames{"idle", "armed", "running", "braking", "fault"};
  return kNames[static_cast<size_t>(state)];
}

Supervisor::Supervisor(const Limits& limits, const PendulumState& start, const Joints& motor_limit,
                       double angle_range, double quantum)
    : limits_(limits),
      start_(start),
      motor_limit_(motor_limit),
      angle_range_(angle_range),
      quantum_(quantum) {
  for (double& limit : motor_limit_) limit = std::min(limit, limits.torque);
  constexpr size_t kLongestReason = 160;
  reason_.reserve(kLongestReason);
}

void Supervisor::Fault(const char* text, double first, double second) {
  if (!reason_.empty()) return;  // the first reason stays
  std::array<char, 150> line{};
  std::snprintf(line.data(), line.size(), text, first, second);
  reason_ = line.data();
}

void Supervisor::Brake(const CycleFacts& facts) {
  state_ = LoopState::kBraking;
  since_ = slow_since_ = facts.time;
}

bool Supervisor::IsStuck(const CycleFacts& facts) {
  const double h = facts.read_at - last_time_;
  const bool known = readings_ > 1 && h > 0;
  bool stuck = false;
  for (size_t j = 0; j < 2; ++j) {
    const double change = facts.angle[j] - last_angle_[j];
    if (known && change == 0) {
      // A joint cannot stop within a cycle: its encoder did.
      const double stop = kHardest * h + 2 * quantum_ / h;
      stuck = stuck || (++repeats_[j] >= kStuckReadings && std::abs(speed_[j]) > stop);
    } else {
      repeats_[j] = 0;
      speed_[j] = known ? change / h : 0;
    }
  }
  last_time_ = facts.read_at;
  last_angle_ = facts.angle;
  return stuck;
}

bool Supervisor::CheckReading(const CycleFacts& facts) {
  bool good = true;
  const auto fault = [&](const char* text, double first = 0, double second = 0) {
    good = false;
    Fault(text, first, second);
  };
  const bool driving = state_ == LoopState::kRunning || state_ == LoopState::kBraking;
  if (facts.locked && driving) fault("the machine's watchdog has switched its motors off");
  for (size_t j = 0; j < 2; ++j) {
    const int joint = static_cast<int>(j) + 1;
    if (!Within(facts.angle[j], kLargestReading) || !Within(facts.torque[j], kLargestReading)) {
      fault("joint %.0f: expected a finite reading, got another number", joint);
    } else if (std::abs(facts.angle[j]) >= angle_range_) {
      fault("joint %.0f: the encoder saturates at %.4g rad", joint, facts.angle[j]);
    }
  }
  if (good && IsStuck(facts)) fault("an encoder sticks while its joint moves");
  return good;
}

void Supervisor::CheckLimits(const CycleFacts& facts) {
  const auto& [q1, q2, w1, w2] = facts.state;
  const double angle = std::max(std::abs(q1), std::abs(q2));
  const double velocity = std::max(std::abs(w1), std::abs(w2));
  if (!Within(angle, limits_.angle)) {
    Fault("angle: %.4g rad is beyond the limit %.4g rad", angle, limits_.angle);
  } else if (!Within(velocity, limits_.velocity)) {
    Fault("velocity: %.4g rad/s is beyond the limit %.4g rad/s", velocity, limits_.velocity);
  } else if (!Within(facts.energy, limits_.energy)) {
    Fault("energy: %.4g is beyond the limit %.4g", facts.energy, limits_.energy);
  }
}

bool Supervisor::AtStart(const PendulumState& s) const {
  return Within(Wrapped(s.q1 - start_.q1), kStartAngle) &&
         Within(Wrapped(s.q2 - start_.q2), kStartAngle) &&
         Within(s.w1 - start_.w1, kStartVelocity) && Within(s.w2 - start_.w2, kStartVelocity);
}

void Supervisor::Wait(const CycleFacts& facts) {
  if (!begun_) since_ = facts.time;
  begun_ = true;
  if (facts.stop) {
    ended_ = true;
    state_ = LoopState::kIdle;
  } else if (facts.time - since_ > limits_.patience) {
    Fault(state_ == LoopState::kIdle
              ? "no readings within %.4g s"
              : "the machine did not come to rest in its start state within %.4g s",
          limits_.patience);
    state_ = LoopState::kFault;
  } else if (state_ == LoopState::kIdle && readings_ >= kArmReadings) {
    state_ = LoopState::kArmed;
    since_ = facts.time;
  } else if (state_ == LoopState::kArmed && facts.locked) {
    // Idle commands unlock the motors.
    state_ = LoopState::kIdle;
    readings_ = 0;
  } else if (state_ == LoopState::kArmed && facts.fresh && AtStart(facts.state)) {
    state_ = LoopState::kRunning;
  }
}

LoopState Supervisor::Step(const CycleFacts& facts) {
  if (ended()) return state_;
  readings_ = facts.fresh ? readings_ + 1 : readings_;
  if (state_ == LoopState::kIdle && !facts.fresh) readings_ = 0;
  if (facts.fresh && !CheckReading(facts)) return state_ = LoopState::kFault;
  if (state_ != LoopState::kIdle && facts.age > limits_.age) {
    Fault("the last reading is %.4g s old, beyond the limit %.4g s", facts.age, limits_.age);
    return state_ = LoopState::kFault;
  }
  if (state_ == LoopState::kRunning) {
    CheckLimits(facts);
    if (!reason_.empty() || facts.stop) Brake(facts);
  } else if (state_ == LoopState::kBraking) {
    if (!AtRest(facts.state)) slow_since_ = facts.time;
    if (facts.time - slow_since_ >= kSlowSeconds || facts.time - since_ >= limits_.brake_seconds) {
      ended_ = true;
      state_ = reason_.empty() ? LoopState::kIdle : LoopState::kFault;
    }
  } else {
    Wait(facts);
  }
  return state_;
}

Joints Supervisor::Torque(const Joints& controller, const CycleFacts& facts) {
  Joints torque{};
  if (state_ == LoopState::kRunning) {
    torque = controller;
    if (!std::isfinite(torque[0]) || !std::isfinite(torque[1])) {
      Fault("the controller's torque is not a finite number");
      state_ = LoopState::kFault;
      return {};
    }
  } else if (state_ == LoopState::kBraking) {
    torque = {-limits_.brake_damping * facts.state.w1, -limits_.brake_damping * facts.state.w2};
  }
  bool clipped = false;
  for (size_t j = 0; j < 2; ++j) {
    const double asked = torque[j];
    torque[j] = std::clamp(asked, -motor_limit_[j], motor_limit_[j]);
    clipped = clipped || torque[j] != asked;
  }
  clipped_ += clipped && state_ == LoopState::kRunning ? 1 : 0;
  return torque;
}

PendulumState ParseStart(const std::string& text) {
  if (text == "hanging") return {};
  if (text == "upright") return {std::numbers::pi, 0, 0, 0};
  std::vector<double> numbers;
  for (const std::string_view piece : Split(text, ',')) {
    const auto number = ParseNumber(piece);
    if (number && Within(*number, kLargestStart)) numbers.push_back(*number);
  }
  if (numbers.size() != 4 || std::ranges::count(text, ',') != 3) {
    throw BadInput(Concat("--start: expected hanging, upright or four numbers q1,q2,w1,w2 within ±",
                          kLargestStart, ", got \"", Printable(text), "\""));
  }
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

}  // namespace upswing
