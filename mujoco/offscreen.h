#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mujoco/pendulum_scene.h"

namespace upswing {

struct ScenePanel;

/// Smallest and largest width and height of a picture, pixels.
inline constexpr int kLeastPixels = 16, kMostPixels = 8192;

/// Size of a picture, pixels.
struct PictureSize {
  int width = 640, height = 480;

  bool operator==(const PictureSize&) const = default;
};

/// The size; throws BadInput if it is out of range.
PictureSize CheckedSize(PictureSize size);

/// Pictures without a window: MuJoCo's own rendering over EGL, which is loaded at run time. Any
/// thread may use it, one at a time; several of these do not disturb each other.
class Offscreen {
 public:
  /// Throws BadInput if a size is out of range, and Failure with what to install where there is no
  /// EGL or no device for it.
  explicit Offscreen(PictureSize size);
  ~Offscreen();

  /// The picture of these panels side by side: pixels (height × width × 3), red, green, blue, the
  /// top row first, until the next call.
  std::span<const uint8_t> Render(std::span<const ScenePanel> panels);

  PictureSize size() const { return size_; }

 private:
  struct Graphics;

  PictureSize size_;
  std::unique_ptr<Graphics> graphics_;
  std::vector<uint8_t> pixels_, rows_;  // top row first, and as OpenGL has them
};

}  // namespace upswing
