#include "extras/machine/drive/frame.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "os/gzip.h"

namespace upswing::machine {
namespace {

/// The bytes of a frame. All numbers are little-endian.
struct [[gnu::packed]] Layout {
  uint32_t magic = 0x57535055;  // "UPSW"
  uint8_t version = 1;
  uint8_t kind = 0;
  uint16_t flags = 0;
  uint32_t sequence = 0, answers = 0;
  uint64_t microseconds = 0;
  float torque1 = 0, torque2 = 0, angle1 = 0, angle2 = 0;
  uint32_t checksum = 0;
};
static_assert(sizeof(Layout) == kFrameBytes && std::endian::native == std::endian::little);

/// The checksum of all bytes before it.
uint32_t ChecksumOf(const FrameBytes& bytes) {
  return Crc32(std::span(bytes).first<kFrameBytes - sizeof(uint32_t)>());
}

}  // namespace

FrameBytes Encode(const Frame& frame) {
  Layout layout{.kind = static_cast<uint8_t>(frame.kind),
                .flags = frame.flags,
                .sequence = frame.sequence,
                .answers = frame.answers,
                .microseconds = frame.microseconds,
                .torque1 = static_cast<float>(frame.torque[0]),
                .torque2 = static_cast<float>(frame.torque[1]),
                .angle1 = static_cast<float>(frame.angle[0]),
                .angle2 = static_cast<float>(frame.angle[1])};
  layout.checksum = ChecksumOf(std::bit_cast<FrameBytes>(layout));
  return std::bit_cast<FrameBytes>(layout);
}

std::optional<Frame> Decode(std::span<const std::byte, kFrameBytes> bytes) {
  FrameBytes copy;
  std::ranges::copy(bytes, copy.begin());
  const auto got = std::bit_cast<Layout>(copy);
  const Layout known;
  if (got.magic != known.magic || got.version != known.version || got.kind < 1 || got.kind > 2 ||
      got.checksum != ChecksumOf(copy)) {
    return {};
  }
  return Frame{static_cast<Frame::Kind>(got.kind),
               got.flags,
               got.sequence,
               got.answers,
               got.microseconds,
               {got.torque1, got.torque2},
               {got.angle1, got.angle2}};
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
  const size_t room = buffer_.size() - size_;
  if (bytes.size() > room) {
    const size_t oldest = bytes.size() - room;
    skipped_ += static_cast<int64_t>(oldest);
    Skip(oldest);
  }
  std::ranges::copy(bytes, buffer_.begin() + static_cast<std::ptrdiff_t>(size_));
  size_ += bytes.size();
}

std::optional<Frame> FrameReader::Next() {
  std::optional<Frame> frame;
  size_t begin = 0;
  while (!frame && size_ - begin >= kFrameBytes) {
    frame = Decode(std::span(buffer_).subspan(begin).first<kFrameBytes>());
    if (!frame) ++begin;
  }
  skipped_ += static_cast<int64_t>(begin);
  Skip(begin);
  if (frame) Skip(kFrameBytes);
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
