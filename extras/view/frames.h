#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

/// Recording of frames as a film or as picture files.
namespace upswing {

/// Receiver of the frames of a recording. The recording appears under its name only when it is
/// finished.
class FrameWriter {
 public:
  virtual ~FrameWriter() = default;
  /// Writes one frame: pixels (height × width × 3), top row first. Throws Failure.
  virtual void Write(std::span<const uint8_t> rgb) = 0;
  /// Completes the recording. Throws as Write does.
  virtual void Finish() = 0;
};

/// Format of a recording.
struct FrameFormat {
  int width, height;  // pixels
  double fps;         // frames per second
  int64_t frames;     // total number of frames
};

enum class RecordingKind {
  kMp4,     // FILE.mp4, made with ffmpeg
  kGif,     // FILE.gif, made with ffmpeg
  kPng,     // FILE.png: the last frame
  kFolder,  // FOLDER/: one PNG per frame, frame-00000.png and so on
};

/// The kind of recording that a path asks for. Throws BadInput that names `flag` if the path fits
/// no kind.
RecordingKind RecordingKindOf(const std::string& flag, const std::string& path);

/// Begins a recording. Throws BadInput that names `flag` if the path is not writable. Throws
/// Failure if a required program is missing.
std::unique_ptr<FrameWriter> MakeFrameWriter(const std::string& flag, const std::string& path,
                                             const FrameFormat& format);

}  // namespace upswing
