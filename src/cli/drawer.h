#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include "os/making.h"

namespace upswing {

/// The program in Python that draws: the text of python/upswing/_view.py.
const char* ViewProgram();

/// A Python that runs ViewProgram. It asks for states in lines, and gets a line for each.
class Drawer {
 public:
  /// Starts Python with these instructions (JSON). UPSWING_PYTHON names another one than `python3`.
  /// Throws Failure.
  explicit Drawer(std::string job);
  /// Ends Python if it still runs.
  ~Drawer();
  Drawer(const Drawer&) = delete;
  Drawer& operator=(const Drawer&) = delete;

  /// Waits for the next line. Returns nothing if Python ends, or if StopSignal tells to stop.
  std::optional<std::string> Next();
  void Answer(const std::string& line);

  /// Waits for the end of Python. Returns its exit code; it has printed what went wrong. Throws
  /// Failure if a signal ended it.
  int Finish();

 private:
  int Wait();

  Descriptor socket_;
  pid_t child_ = -1;
  std::string read_;  // not yet a whole line
};

}  // namespace upswing
