#include "extras/machine/frame.h"

#include <algorithm>
#include <bit>
#include <concepts>
#include <cstring>

#include "os/gzip.h"

namespace upswing::machine {
namespace {

constexpr uint32_t kMagic = 0x57535055;  // "UPSW"
constexpr uint8_t kVersion = 1;
constexpr size_t kChecked = kFrameBytes - sizeof(uint32_t);  // bytes under the checksum

/// Writes little-endian numbers one after another.
class Writer {
 public:
  explicit Writer(std::byte* to) : to_(to) {}
  template <std::unsigned_integral T>
  void operator()(T value) {
    for (size_t i = 0; i < sizeof(T); ++i) *to_++ = static_cast<std::byte>(value >> (8 * i));
  }
  void operator()(double value) { (*this)(std::bit_cast<uint32_t>(static_cast<float>(value))); }

 private:
  std::byte* to_;
};

/// Reads little-endian numbers one after another.
class Reader {
 public:
  explicit Reader(const std::byte* from) : from_(from) {}
  template <std::unsigned_integral T>
  T Get() {
    uint64_t value = 0;
    for (size_t i = 0; i < sizeof(T); ++i) value |= static_cast<uint64_t>(*from_++) << (8 * i);
    return static_cast<T>(value);
  }
  double GetFloat() { return std::bit_cast<float>(Get<uint32_t>()); }

 private:
  const std::byte* from_;
};

}  // namespace

FrameBytes Encode(const Frame& frame) {
  FrameBytes bytes{};
  Writer write(bytes.data());
  write(kMagic);
  write(kVersion);
  write(static_cast<uint8_t>(frame.kind));
  write(frame.flags);
  write(frame.sequence);
  write(frame.answers);
  write(frame.microseconds);
  for (const double torque : frame.torque) write(torque);
  for (const double angle : frame.angle) write(angle);
  write(Crc32(std::span(bytes).first<kChecked>()));
  return bytes;
}

std::optional<Frame> Decode(std::span<const std::byte, kFrameBytes> bytes) {
  Reader read(bytes.data());
  if (read.Get<uint32_t>() != kMagic || read.Get<uint8_t>() != kVersion) return {};
  const auto kind = read.Get<uint8_t>();
  if (kind != 1 && kind != 2) return {};
  if (Reader(bytes.data() + kChecked).Get<uint32_t>() != Crc32(bytes.first<kChecked>())) return {};
  Frame frame;
  frame.kind = static_cast<Frame::Kind>(kind);
  frame.flags = read.Get<uint16_t>();
  frame.sequence = read.Get<uint32_t>();
  frame.answers = read.Get<uint32_t>();
  frame.microseconds = read.Get<uint64_t>();
  for (double& torque : frame.torque) torque = read.GetFloat();
  for (double& angle : frame.angle) angle = read.GetFloat();
  return frame;
}

void FrameReader::Skip(size_t bytes) {
  std::memmove(buffer_.data(), buffer_.data() + bytes, size_ - bytes);
  size_ -= bytes;
}

void FrameReader::Add(std::span<const std::byte> bytes) {
  if (datagrams_ && (bytes.size() != kFrameBytes || !Decode(bytes.first<kFrameBytes>()))) {
    skipped_ += static_cast<int64_t>(bytes.size());
    return;
  }
  if (bytes.size() > buffer_.size()) {
    skipped_ += static_cast<int64_t>(bytes.size() - buffer_.size());
    bytes = bytes.last(buffer_.size());
  }
  if (size_ + bytes.size() > buffer_.size()) {
    const size_t excess = size_ + bytes.size() - buffer_.size();
    skipped_ += static_cast<int64_t>(excess);
    Skip(excess);
  }
  std::ranges::copy(bytes, buffer_.begin() + static_cast<std::ptrdiff_t>(size_));
  size_ += bytes.size();
}

std::optional<Frame> FrameReader::Next() {
  size_t begin = 0;
  std::optional<Frame> frame;
  for (; size_ - begin >= kFrameBytes; ++begin) {
    frame = Decode(std::span(buffer_).subspan(begin).first<kFrameBytes>());
    if (frame) break;
  }
  skipped_ += static_cast<int64_t>(begin);
  Skip(begin + (frame ? kFrameBytes : 0));
  return frame;
}

SequenceFilter::Verdict SequenceFilter::Judge(uint32_t sequence) {
  const auto ahead = static_cast<int32_t>(sequence - last_);
  if (any_ && ahead <= 0) return ahead == 0 ? Verdict::kDuplicate : Verdict::kOld;
  any_ = true;
  last_ = sequence;
  return Verdict::kNew;
}

}  // namespace upswing::machine
