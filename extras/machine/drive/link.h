#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "base/rng.h"
#include "extras/machine/drive/channel.h"
#include "extras/machine/drive/frame.h"
#include "extras/machine/twin/simulated_machine.h"
#include "extras/machine/twin/twin.h"

/// Links of a control loop to a machine. A link brings the clock of its machine.
namespace upswing::machine {

/// Faults of a link, as numbers of frames and bytes.
struct LinkCounts {
  int64_t sent = 0, received = 0;
  int64_t lost = 0;        // gaps in the sequence numbers of the readings
  int64_t duplicates = 0;  // readings that came twice
  int64_t old = 0;         // readings that came after newer ones
  int64_t broken = 0;      // bytes that belong to no frame
};

/// A reading by the loop's clock: the machine measured between `time`, when the answered command
/// was sent, and `received`. The machine's own clock is not used.
struct LinkReading : TimedReading {
  double received = 0;  // s
  bool locked = false;  // whether the machine's watchdog has locked its motors
};

/// Number of final commands with motors off.
inline constexpr int kFarewells = 3;

class MachineLink {
 public:
  virtual ~MachineLink() = default;
  /// Seconds since the link was opened.
  virtual double Now() const = 0;
  /// Waits until a time (s).
  virtual void WaitUntil(double time) = 0;
  /// Sends torques (N·m; `enabled`: the motors may be on), and returns the reading that answers
  /// them. Without an answer at the time `until` (s), returns the newest reading since the last
  /// call, if there is one.
  virtual std::optional<LinkReading> Exchange(const Joints& torque, bool enabled, double until) = 0;
  /// Tells the machine at once that its motors are off; commands after it are invalid. For the
  /// handlers of signals that end the program: takes no lock and no memory.
  virtual void SwitchOffAtOnce() {}
  virtual LinkCounts counts() const { return {}; }
  /// Whether the clock is simulated: the loop may run faster than time.
  virtual bool simulated() const { return false; }
};

/// A twin's machine in this process, with the twin's delays of cycles. Its clock jumps, and equal
/// seeds give equal bits.
class TwinLink : public MachineLink {
 public:
  TwinLink(const Twin& twin, const PendulumState& start, uint64_t seed);

  double Now() const override { return machine_.time(); }
  void WaitUntil(double time) override;
  std::optional<LinkReading> Exchange(const Joints& torque, bool enabled, double until) override;
  bool simulated() const override { return true; }

 private:
  LoopTiming timing_;
  double limit_;  // of both motors, N·m
  SimulatedMachine machine_;
  Rng rng_;
};

/// The loop's side of the exchange of frames, without a line and a clock.
class LinkProtocol {
 public:
  /// `datagrams`: whether bytes come in datagrams, each one frame.
  explicit LinkProtocol(bool datagrams) : reader_(datagrams) {}

  /// The next command, to be sent at a time (s).
  FrameBytes Command(const Joints& torque, bool enabled, double now);
  /// A command that switches the motors off and makes all commands before it and for the next hour
  /// too old.
  FrameBytes LastCommand() const;
  /// Takes bytes that arrived until a time (s). Returns the newest reading among them.
  std::optional<LinkReading> Take(std::span<const std::byte> bytes, double now);
  /// Whether the newest reading answers the last command.
  bool answered() const { return answered_ == sequence_; }
  /// All but `sent`.
  LinkCounts counts() const;

 private:
  /// Whether a frame is a new reading.
  bool IsNew(const Frame& frame);
  LinkReading ReadingOf(const Frame& frame, double now);

  FrameReader reader_;
  SequenceFilter filter_;
  LinkCounts counts_;
  std::atomic<uint32_t> sequence_ = 0;  // of the last command; signal handlers read it
  uint32_t answered_ = 0;               // sequence number that the newest reading answers
  double last_time_ = -1;               // of the newest reading, s
  std::array<double, 256> sent_at_{};   // of the last commands, by their sequence numbers, s
};

/// A machine behind a channel, in real time.
class ChannelLink : public MachineLink {
 public:
  explicit ChannelLink(Channel channel);

  double Now() const override;
  void WaitUntil(double time) override;
  std::optional<LinkReading> Exchange(const Joints& torque, bool enabled, double until) override;
  void SwitchOffAtOnce() override;
  LinkCounts counts() const override;

 private:
  Channel channel_;
  int64_t begin_;  // of the clock, ns
  LinkProtocol protocol_;
  int64_t sent_ = 0;
};

}  // namespace upswing::machine
