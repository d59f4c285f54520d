#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "base/options.h"
#include "base/rng.h"
#include "extras/machine/drive/channel.h"
#include "extras/machine/drive/frame.h"
#include "extras/machine/twin/simulated_machine.h"
#include "extras/machine/twin/twin.h"

/// A twin's machine as a process of its own, with the faults of real links and encoders: a
/// rehearsal without hardware, and an example for firmware.
namespace upswing::machine {

/// Faults of a line, for each frame in each direction.
struct LineFaults {
  double loss = 0, duplicate = 0, reorder = 0;  // probabilities
  double delay = 0, jitter = 0;                 // s
};

/// Faults of the machine. Times count from the first command with motors on.
struct MachineFaults {
  static constexpr double kNever = 1e9;

  Joints stuck_after{kNever, kNever};  // time after which the encoder of each joint sticks, s
  // The encoder of each joint shows its angle, and its motor gives its torque, times these.
  Joints encoder_scale{1, 1}, motor_scale{1, 1};
  bool crossed = false;          // whether each encoder shows the other joint
  double saturate = kNever;      // angle at which the encoders saturate, rad
  double nan_after = kNever;     // time after which the angles are NaN, s
  double silent_after = kNever;  // time after which the machine sends nothing, s
};

struct FakeConfig {
  LineFaults line;
  MachineFaults machine;
  double watchdog = 0.05;  // time without a command after which the motors are off, s

  /// Declares each setting in `options`: name, range, unit, help.
  void Describe(Options& options);
};

/// A line that loses, delays, doubles and reorders frames.
class FaultyLine {
 public:
  FaultyLine(const LineFaults& faults, uint64_t seed, std::string_view stream)
      : faults_(faults), rng_(seed, stream) {}
  /// Sends a frame at a time (s).
  void Send(const Frame& frame, double now);
  /// The next frame that has arrived until a time (s).
  std::optional<Frame> Receive(double now);
  /// When the next frame arrives, s; infinite: no frame is on the line.
  double next() const;

 private:
  struct Moving {
    double arrives;  // s
    Frame frame;
  };
  void Put(const Frame& frame, double now);

  LineFaults faults_;
  Rng rng_;
  std::vector<Moving> moving_;
  std::optional<Frame> held_;  // waits until the next one has passed
};

struct FakeCounts {
  int64_t commands = 0;  // accepted
  int64_t refused = 0;   // duplicates, old ones, NaN
  int64_t watchdog = 0;  // times that the watchdog switched the motors off
};

/// The firmware of the fake machine. It answers each accepted command with a reading.
class FakeMachine {
 public:
  FakeMachine(const Twin& twin, const PendulumState& start, const FakeConfig& config);

  /// Takes a frame that arrives at a time (s), and returns the answer.
  std::optional<Frame> Answer(const Frame& command, double now);
  /// Lets time pass. The watchdog switches the motors off if no command came for too long.
  void Advance(double now);

  const PendulumState& state() const { return machine_.state(); }
  const Joints& torque() const { return torque_; }
  const FakeCounts& counts() const { return counts_; }

 private:
  MachineReading Measure(double now);
  void Apply(const Joints& torque);

  FakeConfig config_;
  double limit_;  // of both motors, N·m
  SimulatedMachine machine_;
  SequenceFilter filter_;
  FakeCounts counts_;
  uint32_t sequence_ = 0;
  double last_command_ = 0, enabled_since_ = MachineFaults::kNever;  // s
  // Whether the motors stay off until a command without kEnabled: at first, and after the watchdog.
  bool locked_ = true;
  Joints torque_{};                             // applied, N·m
  std::array<std::optional<double>, 2> stuck_;  // rad
};

/// Serves a machine on a channel in real time until `stop` returns true. Calls `report` once a
/// second.
void Serve(Channel& channel, FakeMachine& machine, const LineFaults& faults, uint64_t seed,
           const std::function<bool()>& stop, const std::function<void(double)>& report);

}  // namespace upswing::machine
