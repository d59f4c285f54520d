#include "extras/realaigym/uptime.h"

#include <algorithm>
#include <cmath>

namespace upswing::realaigym {

Resets::Resets(const ResetRules& rules, uint64_t seed)
    : rules_(rules), rng_(seed, "realaigym: resets") {
  const double interval = kUptimeSeconds / (rules.count + 1);
  for (int k = 1; k <= rules.count; ++k) times_.push_back(k * interval + rng_.Uniform(-1, 1));
  times_.push_back(std::numeric_limits<double>::infinity());
}

void Resets::Begin(double time, bool violated) {
  if (violated) {
    const double delay = next_ == 0 ? time : time - times_[next_ - 1];
    for (size_t k = next_; k < times_.size(); ++k) times_[k] += delay;
    times_.insert(times_.begin() + static_cast<std::ptrdiff_t>(next_), time);
  }
  ++next_;
  active_ = true;
  steps_ = 0;
  for (double& angle : goal_) angle = rng_.Uniform(-std::numbers::pi, std::numbers::pi);
}

std::optional<Joints> Resets::Torque(double time, const PendulumState& measured) {
  constexpr int kCalmSteps = 10;  // without a violation, before a reset may end
  const auto& [q1, q2, w1, w2] = measured;
  const bool violated = std::max(std::abs(q1), std::abs(q2)) > rules_.most_angle ||
                        std::max(std::abs(w1), std::abs(w2)) > rules_.most_velocity;
  since_violation_ = violated ? 0 : std::min(since_violation_ + 1, kCalmSteps);
  if (!active_ && (violated || time >= times_[next_])) Begin(time, violated);
  // The benchmark adds up the steps and asks for more than the length. Rounding gives that here.
  const bool over = steps_ >= std::lround(rules_.seconds / kBoardTimestep);
  if (active_ && over && since_violation_ >= kCalmSteps) active_ = false;
  if (!active_) return std::nullopt;
  ++steps_;
  return Pid(measured);
}

Joints Resets::Pid(const PendulumState& measured) {
  constexpr double kPeriod = 0.001;  // s; the benchmark's PID believes this, at steps of 2 ms
  static const Manipulator body = ManipulatorOf(BoardPlant());
  const ManipulatorTerms held = body.At({measured.q1, measured.q2, 0, 0});  // gravity
  const Joints gravity{held.h1, held.h2};
  const Joints error{goal_[0] - measured.q1, goal_[1] - measured.q2};
  ++errors_;
  Joints torque;
  for (size_t j = 0; j < 2; ++j) {
    error_sum_[j] += error[j];
    const double most = rules_.most_proportional;
    torque[j] = std::clamp(rules_.kp * error[j], -most, most) + rules_.ki * error_sum_[j] * kPeriod;
    if (errors_ > 2) torque[j] += rules_.kd * (error[j] - error_[j]) / kPeriod;
    torque[j] = std::clamp(torque[j], -kBoardTorqueLimit, kBoardTorqueLimit) + gravity[j];
  }
  error_ = error;
  return torque;
}

bool AboveLine(const Joints& q) {
  constexpr BoardPlant kPlant;
  return -kPlant.length1 * std::cos(q[0]) - kPlant.length2 * std::cos(q[0] + q[1]) >
         0.9 * (kPlant.length1 + kPlant.length2);
}

UptimeRun UptimeOf(const MachineLog& log) {
  UptimeRun run;
  double crossing = -1;  // time of the last counted crossing, s
  for (int k = 1; k < log.rows(); ++k) {
    if (!AboveLine(log.angle[k])) continue;
    run.score += (log.time[k] - log.time[k - 1]) / kUptimeSeconds;
    if (AboveLine(log.angle[k - 1]) || log.time[k] - crossing <= 1) continue;
    ++run.swing_ups;
    crossing = log.time[k];
  }
  return run;
}

}  // namespace upswing::realaigym
