#pragma once

#include <array>

#include "extras/machine/drive/expectation.h"
#include "extras/machine/logs/log.h"
#include "pendulum/scale.h"

/// Torque is earned: motors get their full torque once the encoders have shown that they see what
/// it does.
namespace upswing::machine {

/// Assumed step of encoders of an unknown step until they show smaller changes, rad: 1024 steps per
/// turn.
inline constexpr double kUnknownStep = 0.006;

/// A fault in one line: a printf format of numbers.
struct Complaint {
  const char* text = nullptr;  // null: no fault
  std::array<double, 3> numbers{};

  explicit operator bool() const { return text != nullptr; }
};

/// Where the twin's predictions judge the machine.
enum class TwinTrust {
  kNever,  // the twin is about to be identified
  kInRun,  // the twin predicts motions, but not how links at rest begin to move against friction
  kAlways,
};

/// The settings of EarnedTorque.
struct EarnedTorqueConfig {
  double limit = 0;        // largest torque of the controller's motor, N·m
  int actuated_joint = 1;  // of this motor, 1 or 2
  TwinTrust trust = TwinTrust::kAlways;
  bool hangs = true;   // whether the run begins with links that hang
  double quantum = 0;  // step of the encoders, rad; 0: unknown
  Scale scale = {};    // natural units of the machine over those of UsualPlant
};

/// Asks the joints for an answer before the controller drives, and watches that they go on
/// answering.
///
/// All times are for UsualPlant, and count by the scale of the machine.
///
/// A pulse of the controller's motor begins with 1% of its limit and doubles every 25 ms until both
/// joints move. The same impulse in the other direction then stops them. With a twin, each encoder
/// has to show the motion that the twin predicts, in direction and size. Without one, it has to
/// move at all, and the motor's own joint in the direction of the torque: a torque on links at rest
/// accelerates its joint along with it, because the mass matrix is positive definite. Links that do
/// not hang at the start get no pulse, because it would throw them down.
///
/// Afterwards, a joint that must have moved and shows no motion is a fault. With a twin, its
/// prediction and the other encoder say what must have moved (Expectation). Without one, a block
/// that slides with friction stands for the joint of a motor. Its mass and friction follow from the
/// pulse. The joint without a motor must have moved when the other one has turned by 5 rad.
class EarnedTorque {
 public:
  /// A cycle with a new reading.
  struct Cycle {
    double time = 0;  // s
    Joints angle{};   // read, rad
    Expectation expected{};
    double period = 0.002;  // usual time between two cycles, s
  };

  explicit EarnedTorque(const EarnedTorqueConfig& config);

  /// Takes a cycle with a new reading, in any state, after `sent` (N·m) was sent.
  void See(const Cycle& cycle, const Joints& sent);
  /// Whether the links rest, so that a pulse shows how they answer.
  bool quiet() const { return quiet_; }
  /// Whether both joints have answered, or get no pulse.
  bool proven() const { return proven_; }
  /// Judges the answer to the pulses so far.
  Complaint JudgePulse();
  /// The torques (N·m) of the next cycle of the pulses, which begins at a time (s), with a last
  /// reading of this age (s). A pulse waits for readings. After a gap between two cycles, it knows
  /// for how long the last torque acted.
  Joints Pulse(double now, double age);
  /// Judges the last cycle of a run.
  Complaint JudgeRun();
  /// The torques (N·m) that are permitted of the ones that the controller wants. With a twin, links
  /// that show no motion for a while get torques that friction holds. They get more only until the
  /// twin has moved: a torque must be seen to act.
  Joints Permitted(const Joints& wanted);

 private:
  /// What the readings of a joint have shown.
  struct Joint {
    double step;                     // of the encoder, rad
    double angle = 0;                // last reading, rad
    double shown = 0, other = 0;     // angles of both joints at its last visible motion, rad
    double shown_at = 0;             // time of this motion, s
    double lowest = 0, highest = 0;  // readings of this window, rad
    double range = 0;                // of the readings in the last whole window, rad
    double start = 0;                // angle when the pulse began, rad
    bool answered = false;
    int unseen = 0;  // readings in a row that lack a motion
  };
  /// A block that stands for the motor's joint: mass (kg·m²), friction (N·m), and its motion since
  /// the joint's last visible one (rad, rad/s).
  struct Block {
    double mass, friction, moved = 0, velocity = 0;
  };
  enum class Phase { kRest, kPush, kStop };
  /// The torque of the last cycle of the pulses.
  struct Push {
    double torque = 0;  // N·m
    double time = -1;   // s; negative: there was none
  };

  bool PredictsPulse() const { return seen_.expected.known && config_.trust == TwinTrust::kAlways; }
  bool PredictsRun() const { return seen_.expected.known && config_.trust != TwinTrust::kNever; }
  /// A time (s) by the scale of the machine.
  double Time(double usual) const { return usual * config_.scale.time; }
  /// The same, but at least this number of cycles.
  double Time(double usual, double cycles) const;
  /// Least change of an angle that shows a motion, rad.
  double Visible(const Joint& joint) const;
  void MoveBlock(double torque);
  /// At the end of a window of readings, judges whether the links have rested in it.
  void JudgeRest();
  Complaint JudgeJoint(int j);
  Complaint JudgeMotion(int j);
  Complaint JudgeShare(int j);
  double LeastTorque(int j) const;
  Complaint JudgeDirection(int j);
  /// Counts the time for which the last torque of the pulse acted beyond a usual cycle.
  void CountGap(double now);
  bool Answered() const { return joints_[0].answered && joints_[1].answered; }

  EarnedTorqueConfig config_;
  std::array<Joint, 2> joints_;
  Block block_;
  Cycle seen_;
  bool has_seen_ = false, quiet_ = false, proven_ = false;
  double window_begin_ = 0;  // s
  bool held_ = false;        // whether only torques that friction holds are permitted
  double held_at_ = 0;       // since when, s
  Phase phase_ = Phase::kRest;
  Push push_;
  int motor_;             // joint of the controller's motor, 0 or 1
  double amplitude_ = 0;  // N·m
  double impulse_ = 0;    // of the push, N·m·s
  double travel_ = 0;     // double integral of the torque of the push, N·m·s²
  double at_limit_ = 0;   // time at the limit, s
};

}  // namespace upswing::machine
