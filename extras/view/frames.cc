#include "extras/view/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "extras/view/ffmpeg.h"
#include "extras/view/png.h"
#include "os/file.h"
#include "os/streams.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

// Limit on the frames that ffmpeg must keep until it knows all colours.
constexpr double kMostGifBytes = 1e9;

/// Writer of the last frame as a PNG file.
class PngWriter : public FrameWriter {
 public:
  PngWriter(std::string path, const FrameFormat& format)
      : path_(std::move(path)), format_(format) {}
  void Write(std::span<const uint8_t> rgb) override { last_.assign(rgb.begin(), rgb.end()); }
  void Finish() override { WriteNamedFile(path_, EncodePng(last_, format_.width, format_.height)); }

 private:
  std::string path_;
  FrameFormat format_;
  std::vector<uint8_t> last_;
};

/// Writer of one file per frame in a new folder.
class FolderWriter : public FrameWriter {
 public:
  FolderWriter(const fs::path& path, const FrameFormat& format)
      : making_(path, Making::Kind::kFolder), format_(format) {}
  void Write(std::span<const uint8_t> rgb) override {
    // Write frames directly: the folder gets its name only when all frames are there.
    AppendFile frame(making_.path() / fmt::format("frame-{:05}.png", count_++));
    frame.Append(EncodePng(rgb, format_.width, format_.height));
    frame.Sync();
  }
  void Finish() override { making_.Publish(); }

 private:
  Making making_;
  FrameFormat format_;
  int64_t count_ = 0;
};

/// Writer of a film through ffmpeg.
class FilmWriter : public FrameWriter {
 public:
  FilmWriter(const fs::path& path, const FrameFormat& format, RecordingKind kind)
      : making_(path, Making::Kind::kFile), ffmpeg_(Words(format, kind), making_.descriptor()) {}
  void Write(std::span<const uint8_t> rgb) override { ffmpeg_.Write(rgb); }
  void Finish() override {
    ffmpeg_.Finish();
    making_.Publish();
  }

 private:
  /// The words that make ffmpeg read raw frames and write a film.
  static std::vector<std::string> Words(const FrameFormat& format, RecordingKind kind) {
    std::vector<std::string> words{"-f",
                                   "rawvideo",
                                   "-pixel_format",
                                   "rgb24",
                                   "-video_size",
                                   Concat(format.width, 'x', format.height),
                                   "-framerate",
                                   FormatNumber(format.fps),
                                   "-i",
                                   "pipe:0"};
    const auto add = [&](std::initializer_list<const char*> more) {
      words.insert(words.end(), more.begin(), more.end());
    };
    if (kind == RecordingKind::kGif) {
      add({"-vf",
           "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=none:"
           "diff_mode=rectangle",
           "-f", "gif"});
    } else {
      // Players need even sizes and colours at half the resolution.
      add({"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-movflags", "+faststart",
           "-f", "mp4"});
    }
    return words;
  }

  Making making_;
  Ffmpeg ffmpeg_;
};

/// The path for a film, with links resolved, as for every file that a user names.
fs::path Target(const std::string& flag, const std::string& path) {
  const fs::path target = fs::exists(path) ? fs::canonical(path) : fs::path(path);
  if (fs::exists(target) && !fs::is_regular_file(target)) {
    throw BadInput(Concat(flag, " ", path, ": expected a regular file"));
  }
  return target;
}

}  // namespace

RecordingKind RecordingKindOf(const std::string& flag, const std::string& path) {
  if (path.ends_with('/')) return RecordingKind::kFolder;
  std::string ending = fs::path(path).extension();
  std::ranges::transform(ending, ending.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c; });
  if (ending == ".mp4") return RecordingKind::kMp4;
  if (ending == ".gif") return RecordingKind::kGif;
  if (ending == ".png") return RecordingKind::kPng;
  throw BadInput(
      Concat(flag, ": expected FILE.mp4, FILE.gif, FILE.png or FOLDER/, got \"", path, "\""));
}

std::unique_ptr<FrameWriter> MakeFrameWriter(const std::string& flag, const std::string& path,
                                             const FrameFormat& format) {
  const RecordingKind kind = RecordingKindOf(flag, path);
  if (kind == RecordingKind::kFolder) {
    const fs::path folder = fs::path(path).parent_path();  // without the trailing slash
    CheckFree(folder, Concat("choose another ", flag));
    return std::make_unique<FolderWriter>(folder, format);
  }
  CheckWritable(flag, path);
  if (kind == RecordingKind::kPng) return std::make_unique<PngWriter>(path, format);
  if (kind == RecordingKind::kGif) {
    const double bytes = 4.0 * format.width * format.height * static_cast<double>(format.frames);
    if (bytes > kMostGifBytes) {
      throw BadInput(fmt::format(
          "{}: expected a GIF of at most {:.0f} MB of raw frames, got {:.0f} MB ({} frames of "
          "{}x{}); reduce --seconds, --fps or the size, or write an mp4",
          flag, kMostGifBytes / 1e6, bytes / 1e6, format.frames, format.width, format.height));
    }
  }
  return std::make_unique<FilmWriter>(Target(flag, path), format, kind);
}

}  // namespace upswing
