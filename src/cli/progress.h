#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace upswing {

/// A line at the bottom of the terminal that is rewritten a few times a second. Without a
/// terminal the line is not shown, and Print writes plain lines.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine() { Clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool terminal() const { return terminal_; }

  /// Whether Show would draw: there is a terminal, and the last drawing is old enough.
  bool due() const;

  /// Shows a bar of `share` (0 to 1) and as many of the first fields as fit into the terminal.
  void Show(double share, const std::vector<std::string>& fields);

  /// Prints a line that stays, above the bar.
  void Print(const std::string& line);

  /// Removes the bar.
  void Clear();

 private:
  using Clock = std::chrono::steady_clock;
  bool terminal_;
  bool shown_ = false;
  Clock::time_point last_{};
};

/// A progress line for work on episodes or other units: their rate and the time left. Without a
/// terminal, it prints a plain line on standard error every ten seconds.
class EpisodeProgress {
 public:
  /// Shows no bar if `quiet`. `unit`: name of the counted items.
  explicit EpisodeProgress(bool quiet, const char* unit = "episodes")
      : quiet_(quiet), unit_(unit) {}

  /// A Progress. A new `total` begins a new piece of work at the time of the last call.
  void operator()(double done, double total);

 private:
  using Clock = std::chrono::steady_clock;
  double total_ = 0;
  bool quiet_;
  const char* unit_;
  ProgressLine line_;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point last_call_ = begin_;
  Clock::time_point last_plain_ = begin_;
};

}  // namespace upswing
