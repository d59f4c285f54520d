#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "base/text.h"
#include "extras/machine/drive/fake_machine.h"
#include "extras/machine/drive/link.h"
#include "extras/machine/drive/loop_testing.h"

/// A link to a machine with faults of all kinds, for tests of the whole control loop.
namespace upswing::machine {

/// Returns a number from 0 to n - 1: a random one, or one from the input of a fuzzer.
using Chooser = std::function<uint32_t(uint32_t n)>;

/// The twin's machine, whose encoders, clock, firmware and line have faults, in simulated time. It
/// checks what the machine may rely on: `violation` is empty, or the first broken promise.
class AdverseLink : public MachineLink {
 public:
  /// `limit`: largest torque that may come, N·m. `rarity`: mean number of readings from one new
  /// fault to the next.
  AdverseLink(const Twin& twin, const Joints& limit, uint32_t rarity, Chooser choose)
      : choose_(std::move(choose)),
        limit_(limit),
        rarity_(rarity),
        protocol_(/*datagrams=*/choose_(2) == 0),
        clock_(choose_(5)),
        machine_(twin, {}, {.line = {}, .machine = AnyWiring()}) {}

  double Now() const override { return now_; }
  bool simulated() const override { return true; }

  void WaitUntil(double time) override {
    now_ = std::max(now_, time);
    if (choose_(rarity_) == 0) now_ += std::array{0.0005, 0.003, 0.7}[choose_(3)];
  }

  std::optional<LinkReading> Exchange(const Joints& torque, bool enabled,
                                      double /*until*/) override {
    const auto command = Decode(protocol_.Command(torque, enabled, now_));
    Check(*command);
    std::optional<LinkReading> newest;
    const auto deliver = [&](std::span<const std::byte> bytes) {
      if (const auto reading = protocol_.Take(bytes, now_)) newest = reading;
    };
    if (const auto answer = machine_.Answer(*command, now_)) {
      const FrameBytes bytes = Encode(Falsified(*answer));
      Transmit(bytes, deliver);
    }
    Judge(newest);
    return newest;
  }

  const FakeMachine& machine() const { return machine_; }
  const std::string& violation() const { return violation_; }
  /// The torques of the last command, N·m.
  const Joints& torque() const { return torque_; }
  bool enabled() const { return enabled_; }
  /// Whether the encoders report the motion.
  bool honest() const {
    return wired_ && offset_ == Joints{} && sign_ == Joints{1, 1} && !stuck_[0] && !stuck_[1];
  }

 private:
  /// Faults of motors and encoders from the beginning, in half of the runs.
  MachineFaults AnyWiring() {
    MachineFaults faults;
    if (choose_(2) != 0) return faults;
    wired_ = false;
    const size_t j = choose_(2);
    switch (choose_(5)) {
      case 0:
        faults.stuck_after[j] = 0;
        break;
      case 1:
        faults.stuck_after = {0, 0};
        break;
      case 2:
        faults.crossed = true;
        break;
      case 3:
        faults.encoder_scale[j] = std::array{-1.0, 0.5, 2.0}[choose_(3)];
        break;
      default:
        faults.motor_scale[j] = std::array{-1.0, 0.0, 2.0}[choose_(3)];
    }
    return faults;
  }

  void Violate(const std::string& what) {
    if (violation_.empty()) violation_ = what;
  }

  void Check(const Frame& command) {
    enabled_ = (command.flags & Frame::kEnabled) != 0;
    torque_ = command.torque;
    for (size_t j = 0; j < 2; ++j) {
      if (!(std::abs(torque_[j]) <= limit_[j])) Violate(Concat("torque ", torque_[j], " N·m"));
      if (!enabled_ && torque_[j] != 0) Violate("a torque with motors off");
    }
    if (!enabled_) return;
    if (must_stop_) Violate("motors on after a reading that no motion explains");
    if (now_ - last_reading_ > kLargestAge) Violate("a torque from an old reading");
  }

  /// Recognises readings that no motion explains: these would need 67 rad/s and more.
  void Judge(const std::optional<LinkReading>& reading) {
    if (!reading) return;
    for (size_t j = 0; j < 2; ++j) {
      const double change = reading->angle[j] - last_angle_[j];
      const bool soon = last_reading_ >= 0 && now_ - last_reading_ < 0.0045;
      if (!std::isfinite(reading->angle[j]) || (soon && std::abs(change) > 0.3)) must_stop_ = true;
    }
    last_angle_ = reading->angle;
    last_reading_ = now_;
  }

  double AnyNumber() {
    constexpr double kInf = std::numeric_limits<double>::infinity();
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kPi = std::numbers::pi;
    constexpr std::array kNumbers{2 * kPi, -2 * kPi, 14.0, kPi,   -1.0, 0.3,   0.02,
                                  -0.01,   1e30,     kInf, -kInf, 0.0,  1e-30, kNan};
    return kNumbers[choose_(kNumbers.size())];
  }

  /// The reading as faulty encoders, clocks and firmware report it.
  Frame Falsified(Frame frame) {
    if (choose_(rarity_) == 0) {
      const uint32_t j = choose_(2);
      switch (choose_(10)) {
        case 0:
          offset_[j] += AnyNumber();
          break;
        case 1:
          sign_[j] = -sign_[j];
          break;
        case 2:
          stuck_[j] = frame.angle[j];
          break;
        case 3:
          frame.angle[j] += AnyNumber();
          break;
        case 4:
          frame.angle[j] = AnyNumber();
          break;
        case 5:
          frame.torque[j] = AnyNumber();
          break;
        case 6:
          frame.flags ^= Frame::kLocked;
          break;
        case 7:
          frame.sequence += choose_(2) == 0 ? 0x7fffffffU : 0xffffff00U;
          break;
        case 8:
          answers_ = choose_(3) == 0 ? frame.answers : choose_(1000);
          break;
        default:
          stuck_ = {};
      }
    }
    for (size_t j = 0; j < 2; ++j) {
      if (stuck_[j]) frame.angle[j] = *stuck_[j];
      frame.angle[j] = sign_[j] * frame.angle[j] + offset_[j];
    }
    if (answers_) frame.answers = *answers_;
    constexpr uint64_t kFar = uint64_t{1} << 63;
    const uint64_t now = frame.microseconds;
    frame.microseconds = std::array{now, uint64_t{0}, kFar - now, kFar + now, ~now}[clock_];
    return frame;
  }

  /// Brings the bytes of a frame over a faulty line.
  template <class Deliver>
  void Transmit(const FrameBytes& bytes, const Deliver& deliver) {
    if (choose_(rarity_) != 0) return deliver(bytes);
    std::vector<std::byte> line(bytes.begin(), bytes.end());
    switch (choose_(6)) {
      case 0:
        return;
      case 1:
        deliver(bytes);
        return deliver(bytes);
      case 2:
        line.insert(line.end(), bytes.begin(), bytes.end());
        break;
      case 3:
        line.resize(choose_(kFrameBytes));
        break;
      case 4:
        line[choose_(kFrameBytes)] ^= std::byte{1};
        break;
      default:
        for (std::byte& b : line) b = static_cast<std::byte>(choose_(256));
    }
    deliver(line);
  }

  static constexpr double kLargestAge =
      0.0245;  // of a reading behind a torque: --max-age, 2 cycles

  Chooser choose_;
  bool wired_ = true;  // whether motors and encoders work at the beginning
  Joints limit_;       // N·m
  uint32_t rarity_;
  LinkProtocol protocol_;
  uint32_t clock_;
  FakeMachine machine_;
  double now_ = 0, last_reading_ = -1;  // s
  Joints last_angle_{}, torque_{};
  Joints offset_{}, sign_{1, 1};
  std::array<std::optional<double>, 2> stuck_;
  std::optional<uint32_t> answers_;
  bool enabled_ = false, must_stop_ = false;
  std::string violation_;
};

/// A controller whose torques jump, exceed their limits and are not always finite.
class WildController {
 public:
  explicit WildController(Chooser choose) : choose_(std::move(choose)) {}
  double operator()(int64_t /*step*/, const PendulumState& /*state*/) {
    constexpr std::array kTorques{-1e300, -5.0, -1.0, 0.0, 2.0, 5.0, 1e300};
    if (choose_(2) == 0) torque_ = kTorques[choose_(kTorques.size())];
    return choose_(500) == 0 ? std::nan("") : torque_;
  }

 private:
  Chooser choose_;
  double torque_ = 0;  // N·m
};

/// How a run on an adverse machine ended.
struct AdverseRun {
  int64_t cycles = 0;
  std::string reason;     // of the supervisor; empty: no fault
  std::string violation;  // the first broken promise; empty: none
  double energy = 0;      // largest one of the true motion; see Limits
};

/// Largest energy that a machine with faults may get: twice the limit, because torques act for some
/// cycles until a fault shows.
inline constexpr double kMostEnergy = 8;

/// Runs the control loop on an adverse machine for at most `most` cycles.
inline AdverseRun RunAdversely(bool with_twin, uint32_t rarity, int64_t most,
                               const Chooser& choose) {
  LoopBench bench;
  bench.config.seconds = 0.2 + 0.3 * choose(7);
  bench.has_twin = with_twin;
  if (choose(4) > 0) {
    bench.machine_controller = WildController(choose);
  }
  bench.link = std::make_unique<AdverseLink>(bench.twin, Joints{5, 0.5}, rarity, choose);
  const auto& link = dynamic_cast<const AdverseLink&>(*bench.link);
  bench.Make();
  AdverseRun run;
  const Manipulator body = BodyOf(bench.twin);
  const double hanging = -body.At({}).energy;
  int adding = 0;  // cycles in a row in which braking adds energy
  for (bool goes_on = true; goes_on && run.cycles < most && link.violation().empty();) {
    goes_on = bench.loop->Cycle();
    ++run.cycles;
    const PendulumState& s = link.machine().state();
    run.energy = std::max(run.energy, 1 + body.At(s).energy / hanging);
    if (with_twin && run.energy > kMostEnergy) {
      return {run.cycles, bench.supervisor->reason(), "torque was not earned", run.energy};
    }
    const bool brakes = bench.supervisor->state() == LoopState::kBraking && link.honest();
    const double power = link.torque()[0] * s.w1 + link.torque()[1] * s.w2;
    adding = brakes && power > 0 ? adding + 1 : 0;
    if (adding > 2) {
      return {run.cycles, bench.supervisor->reason(), "braking adds energy", run.energy};
    }
  }
  run.reason = bench.supervisor->reason();
  bench.loop->SwitchOff();
  run.violation = link.violation();
  if (link.enabled() || link.machine().torque() != Joints{}) run.violation = "motors on at the end";
  return run;
}

}  // namespace upswing::machine
