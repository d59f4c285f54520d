#include "extras/machine/drive/fake_machine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "base/error.h"
#include "extras/machine/drive/loop_testing.h"

namespace upswing::machine {
namespace {

Frame CommandOf(uint32_t sequence, bool enabled, double torque = 1) {
  return {.flags = enabled ? Frame::kEnabled : uint16_t{0},
          .sequence = sequence,
          .torque = {torque, 0}};
}

TEST(FakeMachine, AnswersAndAppliesOnlyUnlockedCommands) {
  FakeMachine machine(TestTwin(), {}, {});
  const auto locked = machine.Answer(CommandOf(5, true), 0.001);
  ASSERT_TRUE(locked);
  EXPECT_EQ(locked->flags, Frame::kLocked);
  EXPECT_EQ(locked->answers, 5U);
  EXPECT_EQ(machine.torque()[0], 0);
  EXPECT_EQ(machine.Answer(CommandOf(6, false), 0.002)->flags, 0);
  EXPECT_EQ(machine.torque()[0], 0);
  machine.Answer(CommandOf(7, true), 0.004);
  EXPECT_EQ(machine.torque()[0], 1);
  machine.Answer(CommandOf(8, true, 99), 0.006);
  EXPECT_EQ(machine.torque()[0], 5);  // the motor's limit
}

TEST(FakeMachine, RefusesOldFrames) {
  FakeMachine machine(TestTwin(), {}, {});
  machine.Answer(CommandOf(1, false), 0.001);
  machine.Answer(CommandOf(2, true), 0.002);
  EXPECT_FALSE(machine.Answer(CommandOf(2, true, 3), 0.003));
  EXPECT_FALSE(machine.Answer(CommandOf(1, true, 3), 0.003));
  EXPECT_FALSE(machine.Answer(CommandOf(3, true, std::nan("")), 0.003));
  Frame reading = CommandOf(4, true, 3);
  reading.kind = Frame::Kind::kReading;
  EXPECT_FALSE(machine.Answer(reading, 0.003));
  EXPECT_EQ(machine.torque()[0], 1);
  EXPECT_EQ(machine.counts().refused, 4);
}

TEST(FakeMachine, TheWatchdogSwitchesTheMotorsOffAndLocksThem) {
  FakeMachine machine(TestTwin(), {}, {});
  machine.Answer(CommandOf(1, false), 0.001);
  machine.Answer(CommandOf(2, true), 0.002);
  machine.Advance(0.051);
  EXPECT_EQ(machine.torque()[0], 1);
  machine.Advance(0.053);
  EXPECT_EQ(machine.torque()[0], 0);
  EXPECT_EQ(machine.counts().watchdog, 1);
  // An old program that wakes up does not drive; a new one begins with any number.
  EXPECT_EQ(machine.Answer(CommandOf(3, true), 0.06)->flags, Frame::kLocked);
  EXPECT_EQ(machine.torque()[0], 0);
  machine.Advance(1);
  machine.Answer(CommandOf(4, false), 1.001);
  machine.Answer(CommandOf(5, true), 1.002);
  EXPECT_EQ(machine.torque()[0], 1);
}

/// Numbers of the frames in the order in which they arrive.
std::vector<uint32_t> Arrivals(const LineFaults& faults, uint64_t seed, int frames) {
  FaultyLine line(faults, seed, "test");
  std::vector<uint32_t> arrived;
  for (int i = 0; i < frames; ++i) {
    line.Send(CommandOf(static_cast<uint32_t>(i), true), i);
    while (const auto frame = line.Receive(i)) arrived.push_back(frame->sequence);
  }
  return arrived;
}

TEST(FaultyLine, LosesDoublesAndReordersTheGivenShares) {
  constexpr int kFrames = 10'000;
  const auto all = Arrivals({}, 1, kFrames);
  ASSERT_EQ(all.size(), static_cast<size_t>(kFrames));
  EXPECT_TRUE(std::ranges::is_sorted(all));
  // Tolerances: five standard deviations of a binomial distribution.
  EXPECT_NEAR(static_cast<double>(Arrivals({.loss = 0.1}, 1, kFrames).size()), 9000, 150);
  const auto doubled = Arrivals({.duplicate = 0.1}, 1, kFrames);
  EXPECT_NEAR(static_cast<double>(doubled.size()), 11'000, 150);
  EXPECT_EQ(std::set(doubled.begin(), doubled.end()).size(), static_cast<size_t>(kFrames));
  const auto swapped = Arrivals({.reorder = 0.1}, 1, kFrames);
  int back = 0;
  for (size_t i = 1; i < swapped.size(); ++i) back += swapped[i] < swapped[i - 1] ? 1 : 0;
  EXPECT_NEAR(back, 0.1 / 1.1 * kFrames, 150);
  EXPECT_EQ(Arrivals({.loss = 0.1}, 1, 100), Arrivals({.loss = 0.1}, 1, 100));
  EXPECT_NE(Arrivals({.loss = 0.1}, 1, 100), Arrivals({.loss = 0.1}, 2, 100));
}

TEST(FaultyLine, Delays) {
  FaultyLine line({.delay = 0.01, .jitter = 0.005}, 1, "test");
  line.Send(CommandOf(1, true), 1);
  EXPECT_GE(line.next(), 1.01);
  EXPECT_LE(line.next(), 1.015);
  EXPECT_FALSE(line.Receive(1.009));
  EXPECT_TRUE(line.Receive(1.016));
}

TEST(LinkAddress, IsParsed) {
  using Transport = LinkAddress::Transport;
  EXPECT_EQ(ParseLink("udp:host:4000", false).number, 4000);
  EXPECT_EQ(ParseLink("udp:4000", true).place, "127.0.0.1");
  EXPECT_EQ(ParseLink("serial:/dev/ttyACM0", false).number, kUsualBaud);
  EXPECT_EQ(ParseLink("serial:/dev/ttyACM0:1000000", false).place, "/dev/ttyACM0");
  EXPECT_EQ(ParseLink("serial:/dev/ttyACM0:250000", false).number, 250000);
  EXPECT_EQ(ParseLink("/dev/ttyACM0", false).transport, Transport::kSerial);
  EXPECT_EQ(ParseLink("udp:[::1]:4000", false).place, "::1");
  EXPECT_EQ(ParseLink("twin.toml", false).transport, Transport::kTwin);
  EXPECT_EQ(ParseLink("pty", true).transport, Transport::kPty);
  for (const char* wrong : {"udp:4000", "udp::4000", "udp:h:0", "udp:h:65536", "udp:h:x",
                            "serial:", "serial:/dev/tty:96", "tcp:h:1", "udp:::1:4000"}) {
    EXPECT_THROW(ParseLink(wrong, false), Error) << wrong;
  }
  for (const char* wrong : {"", "udp:", "udp:-1", "serial:/dev/tty", "twin.toml"}) {
    EXPECT_THROW(ParseLink(wrong, true), Error) << wrong;
  }
}

}  // namespace
}  // namespace upswing::machine
