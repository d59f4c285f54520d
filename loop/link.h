#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/rng.h"
#include "loop/channel.h"
#include "loop/frame.h"
#include "machine/simulated_machine.h"
#include "machine/twin.h"

/// Links of a control loop to a machine. A link brings the clock of its machine.
namespace upswing {

/// Faults of a link, as numbers of frames and bytes.
struct LinkCounts {
  int64_t sent = 0, received = 0;
  int64_t lost = 0;        // gaps in the sequence numbers of the readings
  int64_t duplicates = 0;  // readings that came twice
  int64_t old = 0;         // readings that came after newer ones
  int64_t broken = 0;      // bytes that belong to no frame
};

/// A reading with the machine's clock and the state of its watchdog.
struct LinkReading : TimedReading {
  double clock = 0;     // of the machine, at the measurement, s
  bool locked = false;  // whether the machine's watchdog has locked its motors
};

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

/// A machine behind a channel, in real time.
class ChannelLink : public MachineLink {
 public:
  explicit ChannelLink(Channel channel);

  double Now() const override;
  void WaitUntil(double time) override;
  std::optional<LinkReading> Exchange(const Joints& torque, bool enabled, double until) override;
  LinkCounts counts() const override;

 private:
  /// Takes a frame from the channel; returns whether it is a new reading.
  bool Take(const Frame& frame);
  LinkReading ReadingOf(const Frame& frame) const;

  Channel channel_;
  int64_t begin_;  // of the clock, ns
  FrameReader reader_;
  SequenceFilter filter_;
  LinkCounts counts_;
  uint32_t sequence_ = 0;
  std::array<double, 256> sent_at_{};  // of the last commands, by their sequence numbers, s
};

/// Nanoseconds of the monotonic clock.
int64_t MonotonicNanoseconds();

/// Locks the program's memory and gives this thread a real-time priority. Returns what is not
/// permitted, in one line; empty: all is.
std::string EnterRealTime();

}  // namespace upswing
