#include "extras/machine/drive/link.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "extras/machine/drive/real_time.h"

namespace upswing::machine {
namespace {

constexpr double kNanoseconds = 1e9;  // in a second

}  // namespace

TwinLink::TwinLink(const Twin& twin, const PendulumState& start, uint64_t seed)
    : timing_(twin.loop),
      limit_(twin.plant.torque_limit),
      machine_(twin, start),
      rng_(seed, "loop: lateness") {}

void TwinLink::WaitUntil(double time) {
  double late = std::max(0.0, timing_.jitter * rng_.Normal());
  if (rng_.Uniform() < timing_.late_share) late += rng_.Uniform(0, timing_.late);
  machine_.Advance(std::max(time + late, machine_.time()));
}

std::optional<LinkReading> TwinLink::Exchange(const Joints& torque, bool enabled,
                                              double /*until*/) {
  Joints applied{};
  if (enabled) {
    for (size_t j = 0; j < 2; ++j) applied[j] = std::clamp(torque[j], -limit_, limit_);
  }
  machine_.Command(applied);
  return LinkReading{{machine_.Read(), machine_.time()}, machine_.time(), false};
}

FrameBytes LinkProtocol::Command(const Joints& torque, bool enabled, double now) {
  const uint32_t own = ++sequence_;
  sent_at_[own % sent_at_.size()] = now;
  Frame command{.flags = enabled ? Frame::kEnabled : uint16_t{0},
                .sequence = own,
                .answers = filter_.last(),
                .microseconds = static_cast<uint64_t>(std::max(now, 0.0) * 1e6)};
  if (enabled) command.torque = torque;
  return Encode(command);
}

FrameBytes LinkProtocol::LastCommand() const {
  constexpr uint32_t kAhead = 1 << 22;  // commands of an hour at 1 kHz
  return Encode({.sequence = sequence_ + kAhead, .answers = filter_.last()});
}

bool LinkProtocol::IsNew(const Frame& frame) {
  if (frame.kind != Frame::Kind::kReading) return false;
  const bool first = counts_.received == 0;
  const uint32_t before = filter_.last();
  const auto verdict = filter_.Judge(frame.sequence);
  if (verdict == SequenceFilter::Verdict::kDuplicate) ++counts_.duplicates;
  if (verdict == SequenceFilter::Verdict::kOld) ++counts_.old;
  if (verdict != SequenceFilter::Verdict::kNew) return false;
  ++counts_.received;
  if (!first) counts_.lost += frame.sequence - before - 1;
  return true;
}

LinkReading LinkProtocol::ReadingOf(const Frame& frame, double now) {
  answered_ = frame.answers;
  const uint32_t ago = sequence_ - frame.answers;
  const bool known = ago < sent_at_.size() && ago < sequence_;
  double time = known ? sent_at_[frame.answers % sent_at_.size()] : now;
  // If `answers` stand still or go back, the time of the measurement is unknown.
  if (time <= last_time_) time = now;
  last_time_ = time;
  return {{{frame.angle, frame.torque}, time}, now, (frame.flags & Frame::kLocked) != 0};
}

std::optional<LinkReading> LinkProtocol::Take(std::span<const std::byte> bytes, double now) {
  std::optional<LinkReading> newest;
  reader_.Add(bytes);
  while (const auto frame = reader_.Next()) {
    if (IsNew(*frame)) newest = ReadingOf(*frame, now);
  }
  return newest;
}

LinkCounts LinkProtocol::counts() const {
  LinkCounts counts = counts_;
  counts.broken = reader_.skipped();
  return counts;
}

ChannelLink::ChannelLink(Channel channel)
    : channel_(std::move(channel)),
      begin_(MonotonicNanoseconds()),
      protocol_(channel_.datagrams()) {}

double ChannelLink::Now() const {
  return static_cast<double>(MonotonicNanoseconds() - begin_) / kNanoseconds;
}

void ChannelLink::WaitUntil(double time) { SleepUntil(begin_ + std::llround(time * kNanoseconds)); }

std::optional<LinkReading> ChannelLink::Exchange(const Joints& torque, bool enabled, double until) {
  if (channel_.Send(protocol_.Command(torque, enabled, Now()))) ++sent_;
  std::optional<LinkReading> newest;
  std::array<std::byte, 1024> buffer;
  do {
    const size_t got = channel_.Receive(buffer);
    if (got == 0) {
      channel_.Wait(until - Now());
      continue;
    }
    if (const auto reading = protocol_.Take(std::span(buffer).first(got), Now())) newest = reading;
    if (newest && protocol_.answered()) return newest;
  } while (Now() < until);
  return newest;
}

void ChannelLink::SwitchOffAtOnce() {
  const FrameBytes last = protocol_.LastCommand();
  for (int i = 0; i < kFarewells; ++i) channel_.Send(last);
}

LinkCounts ChannelLink::counts() const {
  LinkCounts counts = protocol_.counts();
  counts.sent = sent_;
  return counts;
}

}  // namespace upswing::machine
