#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

/// Pictures one after the other, as a film or as files.
namespace upswing {

/// Takes the frames of a recording. What is recorded appears under its name when it is finished,
/// and not at all if it never is.
class FrameWriter {
 public:
  virtual ~FrameWriter() = default;
  /// One frame: pixels (height × width × 3), the top row first. Throws Failure.
  virtual void Write(std::span<const uint8_t> rgb) = 0;
  /// Throws as Write does.
  virtual void Finish() = 0;
};

/// Of a recording.
struct FrameFormat {
  int width, height;  // pixels
  double fps;         // frames a second
  int64_t frames;     // how many there will be
};

enum class RecordingKind {
  kMp4,     // FILE.mp4, made by the program ffmpeg
  kGif,     // FILE.gif, too
  kPng,     // FILE.png: the last frame
  kFolder,  // FOLDER/: each frame as a PNG, frame-00000.png and so on
};

/// What a path asks for. Throws BadInput, which names `flag`, for anything else.
RecordingKind RecordingKindOf(const std::string& flag, const std::string& path);

/// Begins a recording. Throws BadInput, which names `flag`, if it cannot be written there, and
/// Failure if it needs a program that is not there.
std::unique_ptr<FrameWriter> MakeFrameWriter(const std::string& flag, const std::string& path,
                                             const FrameFormat& format);

}  // namespace upswing
