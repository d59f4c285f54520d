#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "extras/view/pendulum_scene.h"

namespace upswing {

struct ScenePanel;

/// Smallest and largest width and height of a picture, pixels.
inline constexpr int kLeastPixels = 16, kMostPixels = 8192;

/// Size of a picture, pixels.
struct PictureSize {
  int width = 640, height = 480;

  bool operator==(const PictureSize&) const = default;
};

/// Returns `size`; throws BadInput if it is out of range.
PictureSize CheckedSize(PictureSize size);

/// Pictures without a window: MuJoCo's rendering over EGL, which is loaded at run time. Any thread
/// may use an object, one thread at a time. Several objects do not disturb each other.
class Offscreen {
 public:
  /// Throws BadInput if a size is out of range. Throws Failure with what to install if EGL or a
  /// device for it is missing.
  explicit Offscreen(PictureSize size);
  ~Offscreen();

  /// Draws these panels next to each other. Returns pixels (height × width × 3), red, green, blue,
  /// top row first; valid until the next call.
  std::span<const uint8_t> Render(std::span<const ScenePanel> panels);

  PictureSize size() const { return size_; }

 private:
  struct Graphics;

  PictureSize size_;
  std::unique_ptr<Graphics> graphics_;
  std::vector<uint8_t> pixels_, rows_;  // top row first; in OpenGL's order
};

}  // namespace upswing
