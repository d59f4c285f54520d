#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "extras/machine/logs/log.h"

/// The frames between a control loop and a machine, over UDP and serial lines.
/// docs/reference/machine-link.md describes the layout for people who write firmware.
namespace upswing::machine {

inline constexpr size_t kFrameBytes = 44;

/// A frame. Its numbers are untrusted: they may be NaN or infinite.
struct Frame {
  enum class Kind : uint8_t {
    kCommand = 1,  // from the loop: torques to apply
    kReading = 2,  // from the machine: measured angles and torques
  };
  /// Bit of `flags` in a command: the motors may apply the torque. Without it they are off.
  static constexpr uint16_t kEnabled = 1;
  /// Bit of `flags` in a reading: the motors are locked, at first and after the watchdog, until a
  /// command without kEnabled.
  static constexpr uint16_t kLocked = 1;

  Kind kind = Kind::kCommand;
  uint16_t flags = 0;
  uint32_t sequence = 0;      // counts the sender's frames
  uint32_t answers = 0;       // sequence number of the last frame that the sender accepted
  uint64_t microseconds = 0;  // the sender's clock
  Joints torque{};            // commanded or measured, N·m
  Joints angle{};             // reading: measured, rad; command: 0
};

using FrameBytes = std::array<std::byte, kFrameBytes>;

FrameBytes Encode(const Frame& frame);

/// The frame in these bytes; nothing unless magic, version, kind and checksum are right.
std::optional<Frame> Decode(std::span<const std::byte, kFrameBytes> bytes);

/// Finds frames in bytes that arrive. In a stream it finds the next whole frame after lost or
/// broken bytes. A datagram that is not exactly one frame is dropped whole.
class FrameReader {
 public:
  /// `datagrams`: whether each call of Add has a datagram.
  explicit FrameReader(bool datagrams) : datagrams_(datagrams) {}
  /// Adds bytes. If there is too little room, the oldest bytes are dropped.
  void Add(std::span<const std::byte> bytes);
  /// The next frame; nothing until more bytes come.
  std::optional<Frame> Next();
  /// Number of bytes that belonged to no frame.
  int64_t skipped() const { return skipped_; }

 private:
  void Skip(size_t bytes);

  bool datagrams_;
  std::array<std::byte, 32 * kFrameBytes> buffer_{};
  size_t size_ = 0;
  int64_t skipped_ = 0;
};

/// Recognises frames that are not newer than the frame before, by their sequence numbers.
class SequenceFilter {
 public:
  enum class Verdict { kNew, kDuplicate, kOld };
  /// Judges a frame. A new one becomes the last one. Numbers may wrap around.
  Verdict Judge(uint32_t sequence);
  /// Accepts any number next.
  void Reset() { any_ = false; }
  uint32_t last() const { return last_; }

 private:
  bool any_ = false;
  uint32_t last_ = 0;
};

}  // namespace upswing::machine
