#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace upswing {

/// A line at the bottom of the terminal that is rewritten a few times a second. Where standard
/// output is no terminal it shows nothing, and Print writes plain lines.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine() { Clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool terminal() const { return terminal_; }

  /// Whether a line would be shown now: there is a terminal, and the last one is old enough.
  bool due() const;

  /// Shows a bar of `share` (0 to 1) and behind it as many of the fields as the terminal has room
  /// for, the first ones first.
  void Show(double share, const std::vector<std::string>& fields);

  /// Prints a line that stays, above the bar.
  void Print(const std::string& line);

  /// Takes the bar away.
  void Clear();

 private:
  using Clock = std::chrono::steady_clock;
  bool terminal_;
  bool shown_ = false;
  Clock::time_point last_{};
};

/// A progress line for work on episodes: their rate and the time left. Where standard output is no
/// terminal, a plain line on standard error every ten seconds.
class EpisodeProgress {
 public:
  /// Shows no bar if `quiet`.
  explicit EpisodeProgress(bool quiet) : quiet_(quiet) {}

  /// As a Progress. Other work began when the last call came.
  void operator()(double done, double total);

 private:
  using Clock = std::chrono::steady_clock;
  double total_ = 0;
  bool quiet_;
  ProgressLine line_;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point told_ = begin_;
  Clock::time_point last_plain_ = begin_;
};

}  // namespace upswing
