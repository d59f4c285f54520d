#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <optional>

#include "extras/machine/drive/link.h"
#include "extras/machine/twin/motion.h"
#include "pendulum/sensors.h"

/// A machine whose gears have play, for tests.
namespace upswing::machine {

/// Where the encoders of a machine with play are.
enum class PlayIn {
  kGearBeforeLink,  // the encoders are at the links, and torques cross the play
  kGearAfterRotor,  // the same, but the encoders are at the rotors
  kEncoder,         // couplings drag the encoders along; the motors have no play
};

/// The machine of a twin whose motors turn the links by gears with play, in simulated time. The
/// rotor of a joint moves freely within the play, and a stiff, damped contact carries the torque at
/// its ends. The twin's armature is the rotors'. Its friction acts on the links.
class PlayLink : public MachineLink {
 public:
  /// `play`: width of the play of each joint, rad.
  PlayLink(const Twin& twin, const Joints& play, PlayIn where)
      : twin_(twin), play_(play), where_(where) {
    Twin links = twin;
    if (where_ != PlayIn::kEncoder) links.plant.armature = 0;
    links_ = BodyOf(links);
  }

  double Now() const override { return time_; }
  bool simulated() const override { return true; }
  void WaitUntil(double time) override {
    const int steps = std::max(1, static_cast<int>(std::ceil((time - time_) / kStep)));
    const double h = (time - time_) / steps;
    if (h <= 0) return;
    for (int i = 0; i < steps; ++i) Step(h);
    time_ = time;
  }
  std::optional<LinkReading> Exchange(const Joints& torque, bool enabled,
                                      double /*until*/) override {
    Joints applied{};
    const double limit = twin_.plant.torque_limit;
    for (int j = 0; enabled && j < 2; ++j) applied[j] = std::clamp(torque[j], -limit, limit);
    commands_.push_back({time_ + twin_.actuator.delay, applied});
    const Joints& shown = where_ == PlayIn::kGearBeforeLink ? link_ : rotor_;
    const double quantum = twin_.sensors.quantum;
    const Joints angle{Quantized(shown[0] + twin_.sensors.zero1, quantum),
                       Quantized(shown[1] + twin_.sensors.zero2, quantum)};
    return LinkReading{{{angle, torque_}, time_}, time_, false};
  }

  /// The true angles of the links, rad.
  const Joints& link() const { return link_; }

 private:
  struct Command {
    double acts_at;  // s
    Joints torque;   // N·m
  };

  static constexpr double kStep = 2e-5;  // s

  void Step(double h) {
    while (!commands_.empty() && commands_.front().acts_at <= time_) {
      asked_ = commands_.front().torque;
      commands_.pop_front();
    }
    const double lag = twin_.actuator.lag;
    Joints contact{};
    for (int j = 0; j < 2; ++j) {
      torque_[j] += (asked_[j] - torque_[j]) * (lag > 0 ? 1 - std::exp(-h / lag) : 1);
      contact[j] = where_ == PlayIn::kEncoder ? torque_[j] : Contact(j);
    }
    const Joints a =
        links_.Acceleration({link_[0], link_[1], link_speed_[0], link_speed_[1]}, contact);
    for (int j = 0; j < 2; ++j) {
      rotor_speed_[j] += h * (torque_[j] - contact[j]) / twin_.plant.armature;
      link_speed_[j] += h * a[j];
      rotor_[j] += h * rotor_speed_[j];
      link_[j] += h * link_speed_[j];
      if (where_ != PlayIn::kEncoder) continue;
      rotor_[j] = std::clamp(rotor_[j], link_[j] - play_[j] / 2, link_[j] + play_[j] / 2);
      rotor_speed_[j] = 0;
    }
    time_ += h;
  }

  /// The torque from the rotor to the link of a joint, N·m.
  double Contact(int j) const {
    constexpr double kFrequency = 1000, kDamping = 0.3;  // of the contact, rad/s and relative
    const double twist = rotor_[j] - link_[j], side = std::copysign(1.0, twist);
    const double pressed = std::abs(twist) - play_[j] / 2;
    if (pressed <= 0) return 0;
    const double stiffness = twin_.plant.armature * kFrequency * kFrequency;
    const double damping = 2 * kDamping * kFrequency * twin_.plant.armature;
    // Contacts push and never pull.
    const double push = stiffness * pressed + side * damping * (rotor_speed_[j] - link_speed_[j]);
    return side * std::max(0.0, push);
  }

  Twin twin_;
  Joints play_;
  PlayIn where_;
  Body links_;
  double time_ = 0;
  std::deque<Command> commands_;
  Joints asked_{}, torque_{};            // N·m
  Joints rotor_{}, link_{};              // rad
  Joints rotor_speed_{}, link_speed_{};  // rad/s
};

}  // namespace upswing::machine
