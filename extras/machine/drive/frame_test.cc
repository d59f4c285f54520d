#include "extras/machine/drive/frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "base/rng.h"
#include "base/text.h"
#include "os/gzip.h"

namespace upswing::machine {
namespace {

Frame Example(uint32_t sequence = 7) {
  return {.kind = Frame::Kind::kReading,
          .flags = 1,
          .sequence = sequence,
          .answers = 0x01020304,
          .microseconds = 0x0102030405060708,
          .torque = {1.5, -0.25},
          .angle = {-3, 0.5}};
}

void ExpectSame(const Frame& a, const Frame& b) {
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.flags, b.flags);
  EXPECT_EQ(a.sequence, b.sequence);
  EXPECT_EQ(a.answers, b.answers);
  EXPECT_EQ(a.microseconds, b.microseconds);
  EXPECT_EQ(a.torque, b.torque);
  EXPECT_EQ(a.angle, b.angle);
}

TEST(Frame, HasTheStandardChecksum) {
  // The check value of CRC-32/ISO-HDLC.
  EXPECT_EQ(Crc32(BytesOf("123456789")), 0xcbf43926U);
}

TEST(Frame, HasTheDocumentedLayout) {
  // From docs/reference/machine-link.md, byte by byte.
  const std::vector<int> expected = {
      0x55, 0x50, 0x53, 0x57, 1, 2, 1,    0,    7, 0, 0,    0,    4, 3, 2,    1,    8, 7, 6, 5,
      4,    3,    2,    1,    0, 0, 0xc0, 0x3f, 0, 0, 0x80, 0xbe, 0, 0, 0x40, 0xc0, 0, 0, 0, 0x3f};
  const FrameBytes bytes = Encode(Example());
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(std::to_integer<int>(bytes[i]), expected[i]) << "byte " << i;
  }
  const auto decoded = Decode(bytes);
  ASSERT_TRUE(decoded);
  ExpectSame(*decoded, Example());
}

TEST(Frame, EveryFlippedBitIsRecognised) {
  for (size_t bit = 0; bit < 8 * kFrameBytes; ++bit) {
    FrameBytes bytes = Encode(Example());
    bytes[bit / 8] ^= static_cast<std::byte>(1 << (bit % 8));
    EXPECT_FALSE(Decode(bytes)) << bit;
  }
}

TEST(FrameReader, FindsFramesInAnyPieces) {
  std::vector<std::byte> stream;
  for (uint32_t i = 0; i < 20; ++i) {
    const FrameBytes bytes = Encode(Example(i));
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  }
  for (const size_t piece : {1, 3, 43, 44, 45, 200}) {
    FrameReader reader(/*datagrams=*/false);
    uint32_t next = 0;
    for (size_t at = 0; at < stream.size(); at += piece) {
      reader.Add(std::span(stream).subspan(at, std::min(piece, stream.size() - at)));
      while (const auto frame = reader.Next()) EXPECT_EQ(frame->sequence, next++);
    }
    EXPECT_EQ(next, 20U) << piece;
    EXPECT_EQ(reader.skipped(), 0);
  }
}

TEST(FrameReader, FindsTheNextFrameAfterBrokenBytes) {
  Rng rng(1, "test: bytes");
  FrameReader reader(/*datagrams=*/false);
  uint32_t whole = 0, found = 0;
  for (uint32_t i = 0; i < 500; ++i) {
    const FrameBytes bytes = Encode(Example(i));
    std::vector<std::byte> sent(bytes.begin(), bytes.end());
    const bool breaks = i % 3 == 1;
    if (breaks) {
      // Lose a byte, or add noise that begins like a frame.
      const auto at = static_cast<std::ptrdiff_t>(rng.Uniform(0, kFrameBytes));
      if (i % 2 == 0) sent.erase(sent.begin() + at);
      if (i % 2 == 1) sent.insert(sent.begin() + at, bytes.begin(), bytes.begin() + 9);
    }
    reader.Add(sent);
    bool came = false;
    while (const auto frame = reader.Next()) {
      EXPECT_TRUE(frame->sequence == i || frame->sequence + 1 == i);
      came = came || frame->sequence == i;
    }
    if (breaks) continue;
    ++whole;
    found += came ? 1 : 0;
  }
  EXPECT_EQ(found, whole);
  EXPECT_GT(reader.skipped(), 0);
}

TEST(FrameReader, DropsTheOldestBytesOfAFlood) {
  FrameReader reader(/*datagrams=*/false);
  const std::vector<std::byte> flood(100'000, std::byte{0x55});
  reader.Add(flood);
  reader.Add(Encode(Example()));
  const auto frame = reader.Next();
  ASSERT_TRUE(frame);
  ExpectSame(*frame, Example());
  EXPECT_EQ(reader.skipped(), 100'000);
}

TEST(FrameReader, ADatagramIsOneFrame) {
  const FrameBytes one = Encode(Example(1)), other = Encode(Example(2));
  std::vector<std::byte> two(one.begin(), one.end());
  two.insert(two.end(), other.begin(), other.end());
  FrameReader reader(/*datagrams=*/true);
  for (const size_t size : {88, 22, 22, 43, 45, 0}) reader.Add(std::span(two).first(size));
  EXPECT_FALSE(reader.Next());
  EXPECT_EQ(reader.skipped(), 88 + 22 + 22 + 43 + 45);
  reader.Add(other);
  const auto frame = reader.Next();
  ASSERT_TRUE(frame);
  ExpectSame(*frame, Example(2));
  EXPECT_FALSE(reader.Next());
}

TEST(SequenceFilter, DistinguishesNewFrames) {
  using Verdict = SequenceFilter::Verdict;
  SequenceFilter filter;
  EXPECT_EQ(filter.Judge(0xfffffffe), Verdict::kNew);
  EXPECT_EQ(filter.Judge(0xfffffffe), Verdict::kDuplicate);
  EXPECT_EQ(filter.Judge(1), Verdict::kNew);  // beyond the wrap
  EXPECT_EQ(filter.Judge(0xffffffff), Verdict::kOld);
  EXPECT_EQ(filter.Judge(1), Verdict::kDuplicate);
  EXPECT_EQ(filter.Judge(2), Verdict::kNew);
  filter.Reset();
  EXPECT_EQ(filter.Judge(1), Verdict::kNew);
}

}  // namespace
}  // namespace upswing::machine
