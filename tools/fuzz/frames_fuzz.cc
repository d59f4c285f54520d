// Target: bytes from a link to a machine. The first byte is the size of the pieces that arrive.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "extras/machine/drive/frame.h"
#include "tools/fuzz/target.h"

namespace upswing {

using namespace machine;

namespace {

bool SameNumber(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

/// Expects that a frame is written and read without a change.
void ExpectWhole(const Frame& frame) {
  const auto again = Decode(Encode(frame));
  Expect(again && again->kind == frame.kind && again->flags == frame.flags &&
             again->sequence == frame.sequence && again->answers == frame.answers &&
             again->microseconds == frame.microseconds,
         "the same frame");
  for (size_t j = 0; j < 2; ++j) {
    Expect(SameNumber(again->angle[j], frame.angle[j]), "the same angles");
    Expect(SameNumber(again->torque[j], frame.torque[j]), "the same torques");
  }
}

}  // namespace

bool TryInput(std::string_view input) {
  if (input.empty()) return false;
  const size_t piece = static_cast<unsigned char>(input[0]) + size_t{1};
  auto bytes = BytesOf(input.substr(1));
  const auto total = static_cast<int64_t>(bytes.size());
  FrameReader reader(/*datagrams=*/false);
  int64_t frames = 0;
  while (!bytes.empty()) {
    const auto next = bytes.first(std::min(piece, bytes.size()));
    reader.Add(next);
    bytes = bytes.subspan(next.size());
    while (const auto frame = reader.Next()) {
      ++frames;
      ExpectWhole(*frame);
    }
  }
  const int64_t used = reader.skipped() + frames * static_cast<int64_t>(kFrameBytes);
  Expect(used <= total && total - used < static_cast<int64_t>(kFrameBytes), "every byte counted");
  return frames > 0;
}

}  // namespace upswing
