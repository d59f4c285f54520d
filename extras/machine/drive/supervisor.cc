#include "extras/machine/drive/supervisor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "base/error.h"
#include "base/text.h"
#include "pendulum/start_text.h"

namespace upswing::machine {
namespace {

// Velocities, accelerations and times are for UsualPlant, and count by the scale of the machine.
// Ages and losses are those of the link, whatever the size.
constexpr double kSlow = 0.3;         // velocity at which braking may end, rad/s
constexpr double kLow = 0.9;          // cosine of a hanging link's angle: 26° from the vertical
constexpr double kSlowSeconds = 0.2;  // time for which the links must hang that slow
constexpr int kStuckReadings = 2;     // unchanged readings after a fast one: a stuck encoder
constexpr double kLargestReading = 1e6;
constexpr double kLargestStart = 100;  // rad, rad/s

// Limits of plausible readings.
constexpr double kFastest = 100;               // velocity that no joint exceeds at first, rad/s
constexpr double kHardest = 1000;              // acceleration that no joint exceeds, rad/s²
constexpr double kOldest = 0.001;              // age of an angle when its command comes, s
constexpr double kShortest = 1e-4;             // time between two measurements, s
constexpr double kLeastError = 0.002;          // of the change between two angles, rad
constexpr int kErrorSteps = 4;                 // of the encoder, in this change
constexpr double kLargestEstimateError = 0.2;  // of the estimate at a slow joint, rad

// Angle after lost readings, less its prediction: most, and most for each second and each step of
// the encoder. With readings of real machines left out for 20 ms it is at most 0.025 rad.
constexpr double kSlip = 0.025, kSlipRate = 1, kSlipSteps = 6;  // rad, rad/s, steps
constexpr double kLostCycles = 1.5, kLongestLoss = 0.025;       // shortest in cycles, longest in s

// Braking that does not work ends with motors off.
constexpr double kBrakeShare = 1.5;                      // of the limits of velocity and energy
constexpr double kEnergyShare = 1.3, kEnergyRise = 0.1;  // of and above the least energy
constexpr double kEnergyTime = 0.1;                      // in which the energy is averaged, s
constexpr double kBrakeBegins = 1.3;  // time until it slows the links, of delay and lag
constexpr double kBrakeCycles = 2.5;  // age of a reading with which the motors may brake

bool Within(double x, double limit) { return std::abs(x) <= limit; }  // false for NaN

/// Whether both links hang, slower than `slow` (rad/s).
bool HangSlowly(const PendulumState& s, double slow) {
  return Within(s.w1, slow) && Within(s.w2, slow) && std::cos(s.q1) > kLow &&
         std::cos(s.q1 + s.q2) > kLow;
}

/// Limits each motor to the largest torque that a single, as frames have it, does not round up.
SupervisorConfig WithSingleLimits(SupervisorConfig config) {
  for (double& limit : config.motor_limit) {
    limit = std::min(limit, config.limits.torque);
    const auto single = static_cast<float>(limit);
    if (single > limit) limit = std::nextafter(single, 0.0F);
  }
  return config;
}

}  // namespace

void Limits::Describe(Options& o) {
  o.Section("limits");
  o.Add(&angle, "max_angle", {0.1, 1e3}, "rad", "largest angle of a joint; beyond it: braking");
  // For another size than that of RealAIGym's robot, For() has other defaults.
  const auto by = [](const Option& option, const char* unit) {
    return Concat(option.plain_text(), ", for another size than RealAIGym's ", unit);
  };
  Option* added = &o.Add(&velocity, "max_velocity", {0.1, 1e3}, "rad/s",
                         "largest velocity of a joint; beyond it: braking");
  added->usual = by(*added, "by the natural time");
  added = &o.Add(&torque, "max_torque", {0, 1e6}, "N·m", "largest torque; larger ones are cut");
  added->usual = by(*added, "the motor's limit");
  added = &o.Add(&passive_torque, "passive_torque", {0, 1e6}, "N·m",
                 "largest torque of the joint without the controller's motor, which only "
                 "compensates friction and brakes");
  added->usual = by(*added, "the limit of its motor");
  o.Add(&energy, "max_energy", {0.1, 1e3}, "",
        "largest mechanical energy, 0 hanging, 1 upright; beyond it: braking");
  o.Add(&age, "max_age", {0.001, 1}, "s", "largest age of the last reading; beyond it: a fault");
  added = &o.Add(&brake_damping, "brake_damping", {0, 1e6}, "N·m·s/rad",
                 "torque against the velocity while braking");
  added->usual = by(*added, "by natural time and torque");
  added = &o.Add(&brake_seconds, "brake_seconds", {0, 600}, "s", "longest time of braking");
  added->usual = by(*added, "by the natural time");
  added = &o.Add(&patience, "patience", {0.1, 3600}, "s",
                 "longest wait for readings and for the start state");
  added->usual = by(*added, "longer for a slower machine");
}

Limits Limits::For(const Twin& twin) {
  Limits limits;
  const Scale scale = ScaleOverUsual(twin.plant);
  if (scale == Scale()) return limits;
  limits.velocity *= scale.velocity();
  limits.torque = twin.plant.torque_limit;
  limits.passive_torque = twin.actuator.passive_limit;
  limits.brake_damping *= scale.torque * scale.time;
  limits.brake_seconds *= scale.time;
  // The link and the people are as slow as before.
  limits.patience *= std::max(1.0, scale.time);
  return limits;
}

const char* NameOf(LoopState state) {
  constexpr std::array kNames{"idle", "armed", "running", "braking", "fault", "probing"};
  return kNames[static_cast<size_t>(state)];
}

bool MayDrive(LoopState state) {
  return state == LoopState::kProbing || state == LoopState::kRunning ||
         state == LoopState::kBraking;
}

Supervisor::Supervisor(const SupervisorConfig& config)
    : config_(WithSingleLimits(config)),
      earned_({.limit = config_.motor_limit[config.actuated_joint == 1 ? 0 : 1],
               .actuated_joint = config.actuated_joint,
               .trust = config.trust,
               .hangs = HangSlowly(config.start, kSlow * config.scale.velocity()),
               .quantum = config.quantum,
               .scale = config.scale}) {
  const double step = config_.quantum > 0 ? config_.quantum : kUnknownStep;
  for (Joint& joint : joints_) {
    joint.step = step;
    joint.fastest = Velocity(kFastest);
    joint.slowest = -joint.fastest;
  }
  constexpr size_t kLongestReason = 300;
  reason_.reserve(kLongestReason);
}

void Supervisor::Report(const Complaint& complaint) {
  if (!reason_.empty()) return;  // the first reason stays
  std::array<char, 300> line{};
  const auto& [first, second, third] = complaint.numbers;
  std::snprintf(line.data(), line.size(), complaint.text, first, second, third);
  reason_ = line.data();
}

void Supervisor::Fail(const Complaint& complaint) {
  Report(complaint);
  state_ = LoopState::kFault;
}

void Supervisor::Brake(const CycleFacts& facts) {
  state_ = LoopState::kBraking;
  since_ = slow_since_ = facts.time;
  energy_ = least_energy_ = facts.energy;
}

/// Keeps the interval of velocities that a motion with accelerations up to kHardest permits. A
/// reading that leaves none is wrong. `shortest`, `longest`: time between the measurements, s.
bool Supervisor::CheckVelocity(Joint& joint, double change, double shortest, double longest) const {
  const double error = std::max(kErrorSteps * joint.step, kLeastError);
  const double most = change + error, least = change - error;  // rad
  // The mean velocity between two measurements differs by half of the acceleration's effect from
  // the velocity at each of them.
  const double differs = Acceleration(kHardest) * longest / 2;
  const double fastest_mean = most > 0 ? most / shortest : most / longest;
  const double slowest_mean = least < 0 ? least / shortest : least / longest;
  const double fastest = std::min(joint.fastest + differs, fastest_mean);
  const double slowest = std::max(joint.slowest - differs, slowest_mean);
  joint.fastest = fastest + differs;
  joint.slowest = slowest - differs;
  return slowest <= fastest;
}

/// Whether the angle stays although the joint must have moved since its last change.
bool Supervisor::IsStuck(Joint& joint, double change, double longest,
                         const CycleFacts& facts) const {
  const double hardest = Acceleration(kHardest);
  if (change != 0) {
    if (config_.quantum <= 0) joint.step = std::min(joint.step, std::abs(change));
    joint.repeats = 0;
    joint.changed_at = facts.received;
    joint.least_speed = (std::abs(change) - joint.step) / longest - hardest * longest / 2;
    return false;
  }
  if (++joint.repeats < kStuckReadings || joint.least_speed <= 0) return false;
  // The least motion: the joint brakes as hard as it can.
  const double v = joint.least_speed;
  const double time = std::clamp(facts.read_at - joint.changed_at, 0.0, v / hardest);
  return v * time - hardest * time * time / 2 > 2 * joint.step;
}

Complaint Supervisor::CheckMotion(const CycleFacts& facts) {
  const double longest = std::max(facts.received - last_read_at_, kShortest);
  const double shortest = std::max(facts.read_at - kOldest - last_received_, kShortest);
  Complaint complaint;
  for (size_t j = 0; j < 2; ++j) {
    Joint& joint = joints_[j];
    const double change = facts.angle[j] - joint.angle;
    joint.angle = facts.angle[j];
    if (!has_reading_) continue;
    joint.rate = facts.read_at > last_read_at_ ? change / (facts.read_at - last_read_at_) : 0;
    const auto number = static_cast<double>(j + 1);
    const bool explained = CheckVelocity(joint, change, shortest, longest + kOldest);
    const bool stuck = IsStuck(joint, change, longest, facts);
    if (!explained) {
      complaint = {"joint %.0f: the angle jumps by %.4g rad, which no motion explains",
                   {number, change}};
    } else if (stuck) {
      complaint = {"joint %.0f: the encoder sticks while the joint moves", {number}};
    }
  }
  has_reading_ = true;
  last_read_at_ = facts.read_at;
  last_received_ = facts.received;
  return complaint;
}

Complaint Supervisor::CheckReading(const CycleFacts& facts) {
  for (size_t j = 0; j < 2; ++j) {
    const auto joint = static_cast<double>(j + 1);
    if (!Within(facts.angle[j], kLargestReading) || !Within(facts.torque[j], kLargestReading)) {
      return {"joint %.0f: expected a finite reading, got another number", {joint}};
    }
    if (std::abs(facts.angle[j]) >= config_.angle_range) {
      return {"joint %.0f: the encoder saturates at %.4g rad", {joint, facts.angle[j]}};
    }
  }
  if (facts.locked && MayDrive(state_)) {
    return {"the machine's watchdog has switched its motors off"};
  }
  return CheckMotion(facts);
}

Complaint Supervisor::CheckEstimate(const CycleFacts& facts) const {
  const auto& [q1, q2, w1, w2] = facts.state;
  if (!std::isfinite(q1 + q2 + w1 + w2 + facts.energy)) {
    return {"the estimate of the state is not finite"};
  }
  if (!facts.fresh) return {};
  const Joints q{q1, q2}, w{w1, w2};
  for (size_t j = 0; j < 2; ++j) {
    const double error = facts.angle[j] - facts.zero[j] - q[j];
    if (Within(error, kLargestEstimateError + std::abs(w[j]) * (facts.age + facts.period)))
      continue;
    return {"joint %.0f: the estimate is %.4g rad from the reading",
            {static_cast<double>(j + 1), error}};
  }
  return {};
}

/// Lost readings leave time for a slip that a hard motion could explain, too. The twin knows
/// better.
Complaint Supervisor::CheckSlip(const CycleFacts& facts) const {
  const Expectation& e = facts.expected;
  if (!e.known || config_.trust == TwinTrust::kNever) return {};
  if (!facts.fresh || e.gap < kLostCycles * facts.period ||
      e.gap > std::max(kLongestLoss, Time(kLongestLoss)))
    return {};
  const Joints w{facts.state.w1, facts.state.w2};
  const double unsure = facts.received - facts.read_at + kOldest;  // of the measurement, s
  for (size_t j = 0; j < 2; ++j) {
    const double most = kSlip + Velocity(kSlipRate) * e.gap + kSlipSteps * joints_[j].step +
                        std::abs(w[j]) * unsure;
    if (Within(e.innovation[j], most)) continue;
    return {"joint %.0f: after lost readings the angle is %.3g rad from its prediction",
            {static_cast<double>(j + 1), e.innovation[j]}};
  }
  return {};
}

Complaint Supervisor::CheckResponse() {
  if (state_ == LoopState::kProbing) return earned_.JudgePulse();
  return earned_.JudgeRun();
}

/// The velocity may not exceed its limit until the torque of the brake has replaced the last one,
/// which takes somewhat longer than the motors' delay and lag.
Complaint Supervisor::CheckLimits(const CycleFacts& facts) const {
  const Limits& limits = config_.limits;
  const auto& [q1, q2, w1, w2] = facts.state;
  const double angle = std::max(std::abs(q1), std::abs(q2));
  const auto fastest = [](double now, double ahead) {
    return std::max(std::abs(now), std::abs(now + kBrakeBegins * (ahead - now)));
  };
  const double velocity = std::max(fastest(w1, facts.ahead.w1), fastest(w2, facts.ahead.w2));
  if (!Within(angle, limits.angle)) {
    return {"angle: %.4g rad is beyond the limit %.4g rad", {angle, limits.angle}};
  }
  if (!Within(velocity, limits.velocity)) {
    return {"velocity: %.4g rad/s is beyond the limit %.4g rad/s", {velocity, limits.velocity}};
  }
  if (!Within(facts.energy, limits.energy)) {
    return {"energy: %.4g is beyond the limit %.4g", {facts.energy, limits.energy}};
  }
  return {};
}

void Supervisor::GoOnBraking(const CycleFacts& facts) {
  const double velocity = std::max(std::abs(facts.state.w1), std::abs(facts.state.w2));
  // The energy of an estimate is noisy, and the last torques of the controller still act at first.
  energy_ += std::min(facts.period / Time(kEnergyTime), 1.0) * (facts.energy - energy_);
  least_energy_ = std::min(least_energy_, energy_);
  if (!Within(velocity, kBrakeShare * config_.limits.velocity) ||
      !Within(facts.energy, kBrakeShare * config_.limits.energy) ||
      energy_ > kEnergyShare * least_energy_ + kEnergyRise) {
    Fail({"braking does not slow the links: %.4g rad/s", {velocity}});
    return;
  }
  if (!AtRest(facts.state)) slow_since_ = facts.time;
  const bool is_moving = facts.time - slow_since_ < Time(kSlowSeconds);
  const bool may_go_on = facts.time - since_ < config_.limits.brake_seconds;
  if (is_moving && may_go_on) return;
  ended_ = true;
  state_ = reason_.empty() ? LoopState::kIdle : LoopState::kFault;
}

/// Whether both links hang slowly. Slow links that stand upright fall when the motors go off.
bool Supervisor::AtRest(const PendulumState& s) const { return HangSlowly(s, Velocity(kSlow)); }

bool Supervisor::AtStart(const PendulumState& s) const {
  return Within(Wrapped(s.q1 - config_.start.q1), config_.start_angle) &&
         Within(Wrapped(s.q2 - config_.start.q2), config_.start_angle) &&
         Within(s.w1 - config_.start.w1, Velocity(kStartVelocity)) &&
         Within(s.w2 - config_.start.w2, Velocity(kStartVelocity));
}

void Supervisor::Wait(const CycleFacts& facts) {
  if (!begun_) since_ = facts.time;
  begun_ = true;
  if (facts.stop) {
    ended_ = true;
    state_ = LoopState::kIdle;
  } else if (facts.time - since_ > config_.limits.patience) {
    const char* text = "the machine did not come to rest in its start state within %.4g s";
    if (state_ == LoopState::kIdle) text = "no readings within %.4g s";
    if (unlocks_) text = "the machine's motors stay locked for %.4g s";
    Fail({text, {config_.limits.patience}});
  } else if (state_ == LoopState::kIdle && readings_ >= kArmReadings) {
    state_ = LoopState::kArmed;
    if (!unlocks_) since_ = facts.time;
  } else if (state_ == LoopState::kArmed && facts.locked) {
    // Idle commands unlock the motors.
    state_ = LoopState::kIdle;
    readings_ = 0;
    unlocks_ = true;
  } else if (state_ == LoopState::kArmed && facts.fresh && AtStart(facts.state)) {
    if (earned_.proven()) {
      state_ = LoopState::kRunning;
    } else if (earned_.quiet()) {
      state_ = LoopState::kProbing;
    }
  }
}

bool Supervisor::CheckAge(double age) {
  if (state_ == LoopState::kIdle || Within(age, config_.limits.age)) return true;
  Fail({"the last reading is %.4g s old, beyond the limit %.4g s", {age, config_.limits.age}});
  return false;
}

LoopState Supervisor::Step(const CycleFacts& facts) {
  if (ended()) return state_;
  if (facts.fresh) {
    ++readings_;
  } else if (state_ == LoopState::kIdle) {
    readings_ = 0;
  }
  if (facts.fresh) {
    if (const Complaint complaint = CheckReading(facts)) {
      Fail(complaint);
      return state_;
    }
    earned_.See({facts.read_at, facts.angle, facts.expected, facts.period}, torque_);
  }
  if (!CheckAge(facts.age)) return state_;
  if (state_ != LoopState::kIdle) {
    if (const Complaint complaint = CheckSlip(facts)) {
      Fail(complaint);
      return state_;
    }
  }
  if (state_ == LoopState::kIdle || state_ == LoopState::kArmed) {
    Wait(facts);
    return state_;
  }
  Drive(facts);
  return state_;
}

void Supervisor::Drive(const CycleFacts& facts) {
  if (const Complaint complaint = CheckEstimate(facts)) {
    Fail(complaint);
    return;
  }
  if (facts.fresh) {
    if (const Complaint complaint = CheckResponse()) {
      Fail(complaint);
      return;
    }
  }
  if (state_ == LoopState::kBraking) {
    GoOnBraking(facts);
    return;
  }
  if (const Complaint complaint = CheckLimits(facts)) {
    Report(complaint);
    beyond_limit_ = true;
    Brake(facts);
  } else if (facts.stop) {
    Brake(facts);
  } else if (state_ == LoopState::kProbing && earned_.proven()) {
    state_ = LoopState::kArmed;
    since_ = facts.time;
  }
}

/// Damping by the least of the measured and the estimated velocities, where all have the same sign.
/// Near the end of a swing they differ, and a torque would add energy.
Joints Supervisor::BrakeTorque(const CycleFacts& facts) const {
  if (!facts.fresh || facts.age > kBrakeCycles * facts.period) return {};
  const Joints now{facts.state.w1, facts.state.w2}, ahead{facts.ahead.w1, facts.ahead.w2};
  Joints torque{};
  for (size_t j = 0; j < 2; ++j) {
    const auto [least, most] = std::minmax({joints_[j].rate, now[j], ahead[j]});
    double velocity = 0;
    if (least > 0) {
      velocity = least;
    } else if (most < 0) {
      velocity = most;
    }
    torque[j] = -config_.limits.brake_damping * velocity;
  }
  return torque;
}

Joints Supervisor::Torque(const Joints& controller, const CycleFacts& facts) {
  torque_ = {};
  Joints wanted{};
  if (state_ == LoopState::kProbing) wanted = earned_.Pulse(facts.time, facts.age);
  if (state_ == LoopState::kRunning) wanted = earned_.Permitted(controller);
  if (state_ == LoopState::kBraking) wanted = earned_.Permitted(BrakeTorque(facts));
  if (!std::isfinite(wanted[0]) || !std::isfinite(wanted[1])) {
    Fail({"the controller's torque is not a finite number"});
    return torque_;
  }
  for (size_t j = 0; j < 2; ++j) {
    const double limit = config_.motor_limit[j];
    torque_[j] = std::clamp(wanted[j], -limit, limit);
  }
  if (state_ == LoopState::kRunning && torque_ != controller) ++clipped_;
  return torque_;
}

PendulumState ParsePendulumStart(const std::string& text, const std::string& where) {
  if (text == "hanging") return {};
  if (text == "upright") return {std::numbers::pi, 0, 0, 0};
  if (std::ranges::count(text, ',') == 3) {
    const PendulumState s = ParseState(text, where);
    const std::array numbers{s.q1, s.q2, s.w1, s.w2};
    if (std::ranges::all_of(numbers, [](double x) { return Within(x, kLargestStart); })) return s;
  }
  throw BadInput(Concat(where, ": expected hanging, upright or four numbers q1,q2,w1,w2 within ±",
                        kLargestStart, " rad and rad/s, got \"", Printable(text), "\""));
}

}  // namespace upswing::machine
