#include "extras/realaigym/olympics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "extras/machine/drive/estimator.h"
#include "extras/machine/twin/simulated_machine.h"
#include "extras/realaigym/machine_trials.h"
#include "extras/realaigym/simulation.h"

namespace upswing::realaigym {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kPeriod = 1.0 / kOlympicsHz;           // s
constexpr double kLateShare = 0.004, kLatest = 0.0675;  // of the cycles; s
constexpr double kNear = 0.3;                           // of a joint at the goal, rad
constexpr double kHold = 3;                             // time at the goal that counts, s
constexpr double kPatience = 15;                        // longest time until then, s
constexpr double kLeading = 0.5;                        // time in which a hand leads the links, s
constexpr double kPushSeconds = 0.1;                    // s
constexpr std::array kPushTorques{0.02, 0.04, 0.06, 0.08, 0.1};  // N·m
constexpr std::array kOuter{0.0, -kPi / 2, kPi / 2};             // angles of joint 2, rad

bool StandsUpright(const PendulumState& s) {
  return std::abs(Wrapped(s.q1 - kPi)) < kNear && std::abs(Wrapped(s.q2)) < kNear;
}

/// The pose of disturbance k: joint 1 at multiples of π/4, joint 2 straight or bent.
Joints PoseOf(int k) { return {k / 3 * kPi / 4, kOuter.at(k % 3)}; }

/// The torque of push k at joint 1, N·m: the smallest ones first, in both directions.
double PushOf(int k) { return (k % 2 == 0 ? 1 : -1) * kPushTorques.at(k / 2); }

/// A policy in a loop with cycles that may be late.
class Pilot {
 public:
  Pilot(const Twin& twin, const MachinePolicy& policy)
      : estimator_(twin, kPeriod),
        controller_(ControllerOf(policy)),
        motor_(MotorOf(RobotOf(*policy))),
        limit_(twin.plant.torque_limit) {}

  /// The torques (N·m) that answer a reading.
  Joints Torque(double time, const Joints& angle) {
    const TimedReading reading{{angle, {}}, time};
    estimator_.Update(time, sent_, &reading);
    // The cycle nearest to the end of a control period counts. After a late one, actions are left
    // out.
    const auto step = static_cast<int64_t>((time + kPeriod / 2) / controller_.period());
    if (step > step_) wanted_ = controller_(step, estimator_.ahead());
    step_ = std::max(step, step_);
    const double friction = estimator_.CompensationTorque(kCompensated)[motor_];
    sent_ = {};
    sent_[motor_] = std::clamp(wanted_ + friction, -limit_, limit_);
    return sent_;
  }

 private:
  Estimator estimator_;
  MachineController controller_;
  size_t motor_;
  double limit_;  // N·m
  int64_t step_ = -1;
  double wanted_ = 0;  // N·m
  Joints sent_{};      // N·m
};

/// A drawn machine, its pilot, and the disturbances.
class Run {
 public:
  Run(const Twin& twin, const MachinePolicy& policy, const Twin& machine, uint64_t seed)
      : machine_(machine, {}), pilot_(twin, policy), rng_(seed, "olympics: cycles") {}

  OlympicsRun Judge() {
    OlympicsRun run;
    run.held = Holds();
    run.swing_up = time_ - kHold;
    for (int k = 0; k < kOlympicsPoses && within_limits_; ++k) {
      Lead(PoseOf(k));
      run.poses += Holds();
    }
    // A push tests links that stand.
    bool stands = Holds();
    for (int k = 0; k < kOlympicsPushes && stands; ++k) {
      push_ = PushOf(k);
      push_end_ = time_ + kPushSeconds;
      stands = Holds();
      run.pushes += stands;
    }
    run.within_limits = within_limits_;
    return run;
  }

 private:
  /// Lets the pilot drive until the links have been at the goal for kHold. False if that takes
  /// longer than kPatience, or if a limit is exceeded.
  bool Holds() {
    const double begin = time_;
    double since = time_;
    while (within_limits_ && time_ < begin + kPatience + kHold) {
      Cycle();
      if (!StandsUpright(machine_.state())) since = time_;
      if (time_ - since >= kHold) return true;
    }
    return false;
  }

  void Cycle() {
    double period = kPeriod;
    if (rng_.Uniform() < kLateShare) period += rng_.Uniform(0, kLatest);
    // A cycle sends the torques of the cycle before.
    const Joints sent = answer_;
    const bool pushed = time_ < push_end_;
    machine_.Command({sent[0] + (pushed ? push_ : 0), sent[1]});
    answer_ = pilot_.Torque(time_, machine_.Read().angle);
    time_ += period;
    if (pushed && time_ >= push_end_) {
      machine_.Advance(push_end_);
      machine_.Command(sent);
    }
    machine_.Advance(time_);
    const PendulumState& s = machine_.state();
    within_limits_ = std::max(std::abs(s.w1), std::abs(s.w2)) <= kOlympicsVelocity &&
                     std::max(std::abs(s.q1), std::abs(s.q2)) <= kOlympicsAngle;
  }

  /// A hand leads the links to a pose (rad) and lets them go at rest. The path of each joint is
  /// that of the least jerk (Flash and Hogan, 1985).
  void Lead(const Joints& pose) {
    const PendulumState begin = machine_.state();
    const Joints way{Wrapped(pose[0] - begin.q1), Wrapped(pose[1] - begin.q2)};
    const double start = time_;
    while (time_ < start + kLeading) {
      const double x = std::min((time_ + kPeriod - start) / kLeading, 1.0);
      const double share = x * x * x * (10 - 15 * x + 6 * x * x);
      const double rate = 30 * x * x * (1 - x) * (1 - x) / kLeading;
      machine_.Command({});
      answer_ = pilot_.Torque(time_, machine_.Read().angle);
      time_ += kPeriod;
      machine_.Advance(time_);
      machine_.Place(
          {begin.q1 + share * way[0], begin.q2 + share * way[1], rate * way[0], rate * way[1]});
    }
  }

  SimulatedMachine machine_;
  Pilot pilot_;
  Rng rng_;
  double time_ = 0;                 // s
  double push_ = 0, push_end_ = 0;  // N·m, s
  Joints answer_{};                 // torques that the next cycle sends, N·m
  bool within_limits_ = true;
};

/// Throws BadInput unless the machine has about the size of CloudPendulum's.
void ExpectUsualSize(const char* flag, const Twin& twin) {
  if (CarryOver(ReadTwin("cloudpendulum", "olympics").plant, twin.plant) == Scale()) return;
  throw BadInput(
      Concat(flag,
             ": expected a machine of about the size of cloudpendulum, for which the pushes and "
             "limits of 2026 are, got one of another size"));
}

}  // namespace

std::vector<OlympicsRun> RunOlympics(const Twin& twin, const MachinePolicy& policy,
                                     const Twin& machines, int count, uint64_t seed,
                                     ThreadPool* pool, const Progress& progress) {
  ExpectUsualSize("--twin", twin);
  ExpectUsualSize("--machine", machines);
  return RunAll(count, pool, progress, [&](int i) {
    Rng rng(seed, "olympics: machine", static_cast<uint64_t>(i));
    const Twin machine = DrawTwin(machines, rng);
    return Run(twin, policy, machine, rng.Next()).Judge();
  });
}

}  // namespace upswing::realaigym
