#pragma once

#include <sys/types.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/making.h"

namespace upswing {

/// The program ffmpeg, which reads from us and writes a file. It is killed unless it is finished.
class Ffmpeg {
 public:
  /// Starts it with these words; it reads our bytes as pipe:0, and writes to the open file
  /// `output`. Throws Failure, with what to install if it is missing.
  Ffmpeg(const std::vector<std::string>& words, int output);
  ~Ffmpeg();
  Ffmpeg(const Ffmpeg&) = delete;
  Ffmpeg& operator=(const Ffmpeg&) = delete;

  /// Throws Failure with ffmpeg's own message if it ended.
  void Write(std::span<const uint8_t> bytes);

  /// Waits until it has written everything. Throws as Write does.
  void Finish();

 private:
  /// Throws what it said; `status` is that of its end.
  [[noreturn]] void Fail(int status);
  int Wait();

  pid_t child_ = -1;
  Descriptor input_;   // its standard input
  Descriptor errors_;  // a nameless file: what it said
};

}  // namespace upswing
