#pragma once

#include <sys/types.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "os/making.h"

namespace upswing {

/// An ffmpeg process that reads from this program and writes a file. The destructor kills it unless
/// Finish was called.
class Ffmpeg {
 public:
  /// Starts ffmpeg with these words. It reads as pipe:0 the bytes given to Write, and it writes to
  /// the open file `output`. Throws Failure; if ffmpeg is missing, the message says what to
  /// install.
  Ffmpeg(const std::vector<std::string>& words, int output);
  ~Ffmpeg();
  Ffmpeg(const Ffmpeg&) = delete;
  Ffmpeg& operator=(const Ffmpeg&) = delete;

  /// Sends bytes to ffmpeg. Throws Failure with ffmpeg's own message if it has ended.
  void Write(std::span<const uint8_t> bytes);

  /// Waits until ffmpeg has written everything. Throws as Write does.
  void Finish();

 private:
  /// Throws Failure with ffmpeg's messages. `status` is its exit status.
  [[noreturn]] void Fail(int status);
  int Wait();

  pid_t child_ = -1;
  Descriptor input_;   // standard input of ffmpeg
  Descriptor errors_;  // nameless file for ffmpeg's messages
};

}  // namespace upswing
