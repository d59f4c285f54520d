#pragma once

#include <optional>
#include <string>

#include "os/duplex_child.h"

namespace upswing {

/// A Python that runs a compiled-in program for a command. Both exchange lines.
class PythonChild {
 public:
  /// Starts Python with a program and its instructions (JSON). UPSWING_PYTHON names another one
  /// than `python3`. Errors begin with `command`. Throws Failure.
  PythonChild(std::string command, const std::string& program, const std::string& job);

  /// Waits for the next line. Returns nothing if Python ends, or if StopSignal tells to stop.
  std::optional<std::string> Next();
  void Answer(const std::string& line);

  /// Waits for the end of Python. Returns its exit code; it has printed what went wrong. Throws
  /// Failure if a signal ended it.
  int Finish();

 private:
  std::string command_;
  std::optional<DuplexChild> child_;
  std::string read_;  // not yet a whole line
};

}  // namespace upswing
