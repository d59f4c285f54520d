#include "cli/progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/format.h"
#include "base/text.h"
#include "cli/say.h"
#include "os/terminal.h"

namespace upswing {

ProgressLine::ProgressLine() : terminal_(IsTerminal(stdout)) {}

bool ProgressLine::due() const {
  return terminal_ && Clock::now() - last_ > std::chrono::milliseconds(200);
}

void ProgressLine::Show(double share, const std::vector<std::string>& fields) {
  constexpr int kBar = 16;
  const int full = static_cast<int>(std::lround(std::clamp(share, 0.0, 1.0) * kBar));
  std::string line =
      fmt::format("[{:=>{}}{: >{}}] {:3.0f}%", "", full, "", kBar - full, 100 * share);
  const auto width = static_cast<size_t>(std::max(30, TerminalWidth(80) - 1));
  for (const std::string& field : fields) {
    if (line.size() + 2 + field.size() > width) break;
    line += "  " + field;
  }
  Say("\r\x1b[K{}", line);
  std::fflush(stdout);
  shown_ = true;
  last_ = Clock::now();
}

void ProgressLine::Print(const std::string& line) {
  Clear();
  Say("{}\n", line);
  std::fflush(stdout);
}

void ProgressLine::Clear() {
  if (shown_) Say("\r\x1b[K");
  std::fflush(stdout);
  shown_ = false;
  last_ = {};
}

void EpisodeProgress::operator()(double done, double total) {
  if (total != total_) begin_ = last_call_;
  total_ = total;
  const auto now = last_call_ = Clock::now();
  const bool plain = !line_.terminal() && now - last_plain_ >= std::chrono::seconds(10);
  if (!plain && (quiet_ || !line_.due())) return;
  const double seconds = std::chrono::duration<double>(now - begin_).count();
  const double rate = done / seconds;
  const std::string episodes =
      Concat(rate < 10 ? fmt::format("{:.2g}", rate) : FormatCount(rate), " ", unit_, "/s");
  const std::string left = FormatDuration((total - done) / rate) + " left";
  if (plain) {
    last_plain_ = now;
    SayError(fmt::format("{:.0f}%  {}  {}", 100 * done / total, episodes, left));
  } else {
    line_.Show(done / total, {episodes, left});
  }
}

}  // namespace upswing
