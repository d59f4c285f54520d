#include "extras/machine/drive/fake_machine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "extras/machine/drive/link.h"
#include "extras/machine/drive/real_time.h"

namespace upswing::machine {

void FakeConfig::Describe(Options& o) {
  o.Section("line");
  o.Add(&line.loss, "loss", kZeroToOne, "", "share of the frames that are lost, in each direction");
  o.Add(&line.duplicate, "duplicate", kZeroToOne, "", "share of the frames that arrive twice");
  o.Add(&line.reorder, "reorder", kZeroToOne, "",
        "share of the frames that arrive after the next one");
  o.Add(&line.delay, "delay", {0, 1}, "s", "delay of each frame");
  o.Add(&line.jitter, "jitter", {0, 1}, "s", "largest additional random delay");
  o.Section("machine");
  o.Add(&machine.saturate, "saturate", {0.01, 1e9}, "rad", "angle at which the encoders saturate")
      .usual = "never";
  o.Add(&machine.encoder_scale[0], "encoder_scale1", {-10, 10}, "",
        "angle that the encoder of joint 1 shows, of the true one; -1: the wrong sign");
  o.Add(&machine.encoder_scale[1], "encoder_scale2", {-10, 10}, "",
        "angle that the encoder of joint 2 shows, of the true one");
  o.Add(&machine.motor_scale[0], "motor_scale1", {-10, 10}, "",
        "torque of the motor of joint 1, of the commanded one; 0: a motor without power");
  o.Add(&machine.motor_scale[1], "motor_scale2", {-10, 10}, "",
        "torque of the motor of joint 2, of the commanded one");
  o.Add(&machine.nan_after, "nan_after", {0, 1e9}, "s",
        "time after which the angles are not numbers")
      .usual = "never";
  o.Add(&machine.silent_after, "silent_after", {0, 1e9}, "s",
        "time after which the machine sends nothing")
      .usual = "never";
  o.Add(&watchdog, "watchdog", {0.001, 10}, "s",
        "time without a command after which the motors are off");
}

void FaultyLine::Put(const Frame& frame, double now) {
  constexpr size_t kMostMoving = 4096;  // frames on the line
  const double arrives =
      now + faults_.delay + (faults_.jitter > 0 ? rng_.Uniform(0, faults_.jitter) : 0);
  if (moving_.size() < kMostMoving) moving_.push_back({arrives, frame});
}

void FaultyLine::Send(const Frame& frame, double now) {
  if (rng_.Uniform() < faults_.loss) return;
  if (!held_ && rng_.Uniform() < faults_.reorder) {
    held_ = frame;
    return;
  }
  Put(frame, now);
  if (rng_.Uniform() < faults_.duplicate) Put(frame, now);
  if (held_) Put(*held_, now);
  held_.reset();
}

double FaultyLine::next() const {
  double first = std::numeric_limits<double>::infinity();
  for (const Moving& m : moving_) first = std::min(first, m.arrives);
  return first;
}

std::optional<Frame> FaultyLine::Receive(double now) {
  // Of frames that arrive at once, the one that was sent first.
  const auto first = std::ranges::min_element(moving_, {}, &Moving::arrives);
  if (first == moving_.end() || first->arrives > now) return {};
  const Frame frame = first->frame;
  moving_.erase(first);
  return frame;
}

FakeMachine::FakeMachine(const Twin& twin, const PendulumState& start, const FakeConfig& config)
    : config_(config), limit_(twin.plant.torque_limit), machine_(twin, start) {}

void FakeMachine::Apply(const Joints& torque) {
  torque_ = torque;
  const Joints& scale = config_.machine.motor_scale;
  machine_.Command({scale[0] * torque[0], scale[1] * torque[1]});
}

void FakeMachine::Advance(double now) {
  const double expires = last_command_ + config_.watchdog;
  if (!locked_ && now >= expires) {
    machine_.Advance(std::max(expires, machine_.time()));
    Apply({});
    ++counts_.watchdog;
    locked_ = true;
    filter_.Reset();  // another program may take over
  }
  machine_.Advance(std::max(now, machine_.time()));
}

MachineReading FakeMachine::Measure(double now) {
  const MachineFaults& faults = config_.machine;
  MachineReading reading = machine_.Read();
  const double since = now - enabled_since_;  // negative infinity before
  if (faults.crossed) std::swap(reading.angle[0], reading.angle[1]);
  for (int j = 0; j < 2; ++j) {
    double& angle = reading.angle[j];
    angle = std::clamp(faults.encoder_scale[j] * angle, -faults.saturate, faults.saturate);
  }
  for (int j = 0; j < 2; ++j) {
    if (since < faults.stuck_after[j]) continue;
    if (!stuck_[j]) stuck_[j] = reading.angle[j];
    reading.angle[j] = *stuck_[j];
  }
  if (since >= faults.nan_after) reading.angle.fill(std::nan(""));
  return reading;
}

std::optional<Frame> FakeMachine::Answer(const Frame& command, double now) {
  Advance(now);
  if (command.kind != Frame::Kind::kCommand || !std::isfinite(command.torque[0]) ||
      !std::isfinite(command.torque[1]) ||
      filter_.Judge(command.sequence) != SequenceFilter::Verdict::kNew) {
    ++counts_.refused;
    return {};
  }
  ++counts_.commands;
  last_command_ = now;
  const bool asked = (command.flags & Frame::kEnabled) != 0;
  if (!asked) locked_ = false;
  const bool enabled = asked && !locked_;
  if (enabled && enabled_since_ == MachineFaults::kNever) enabled_since_ = now;
  Joints torque{};
  if (enabled) {
    for (int j = 0; j < 2; ++j) torque[j] = std::clamp(command.torque[j], -limit_, limit_);
  }
  Apply(torque);
  const MachineReading reading = Measure(now);
  ++sequence_;
  if (now - enabled_since_ >= config_.machine.silent_after) return {};
  return Frame{.kind = Frame::Kind::kReading,
               .flags = locked_ ? Frame::kLocked : uint16_t{0},
               .sequence = sequence_,
               .answers = command.sequence,
               .microseconds = static_cast<uint64_t>(now * 1e6),
               .torque = reading.torque,
               .angle = reading.angle};
}

void Serve(Channel& channel, FakeMachine& machine, const LineFaults& faults, uint64_t seed,
           const std::function<bool()>& stop, const std::function<void(double)>& report) {
  constexpr double kTick = 0.02;  // longest time between two looks at the clock, s
  FaultyLine to_machine(faults, seed, "line: commands"),
      from_machine(faults, seed, "line: readings");
  FrameReader reader(channel.datagrams());
  const int64_t begin = MonotonicNanoseconds();
  const auto clock = [&] { return static_cast<double>(MonotonicNanoseconds() - begin) * 1e-9; };
  std::array<std::byte, 1024> buffer;
  for (double next_report = 1; !stop();) {
    const double next = std::min(to_machine.next(), from_machine.next());
    channel.Wait(std::clamp(next - clock(), 0.0, kTick));
    while (const size_t got = channel.Receive(buffer)) {
      reader.Add(std::span(buffer).first(got));
      while (const auto frame = reader.Next()) {
        channel.AnswerSender();
        to_machine.Send(*frame, clock());
      }
    }
    while (const auto frame = to_machine.Receive(clock())) {
      if (const auto answer = machine.Answer(*frame, clock())) from_machine.Send(*answer, clock());
    }
    while (const auto frame = from_machine.Receive(clock())) channel.Send(Encode(*frame));
    machine.Advance(clock());
    if (clock() >= next_report) {
      report(next_report);
      next_report += 1;
    }
  }
}

}  // namespace upswing::machine
