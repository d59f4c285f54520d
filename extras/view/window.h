#pragma once

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "extras/view/offscreen.h"
#include "extras/view/painter.h"

namespace upswing {

/// A pressed key: a letter or digit as the upper-case character, or one of these constants.
struct Key {
  enum Code {
    kSpace = ' ',
    kEscape = 256,
    kEnter,
    kTab,
    kBackspace,
    kRight = 262,
    kLeft,
    kF1 = 290,
    kF2,
    kF3,
    kF4,
    kF5,
    kF6,
    kF7,
  };
  int code;
  bool shift, control;
};

/// Lines of name and value in a corner of the window.
struct Overlay {
  mjtGridPos place = mjGRID_TOPLEFT;
  std::vector<std::array<std::string, 2>> lines;
};

/// A window with MuJoCo's rendering, by GLFW. Its mouse moves the cameras, selects links and pulls
/// at them, as in MuJoCo's `simulate`. Only the main thread may have one, and only one at a time.
class Window {
 public:
  /// Throws Failure if no window can be opened.
  Window(const std::string& title, PictureSize size);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Whether the user has closed the window.
  bool closed() const;
  void SetTitle(const std::string& title);
  void ToggleFullScreen();
  /// The present size, pixels.
  PictureSize size() const;

  /// Draws the panels, and the overlays over them; `chart` may be null.
  void Draw(std::span<const ScenePanel> panels, std::span<const Overlay> overlays,
            mjvFigure* chart);

  /// The keys pressed since the last call. Mouse actions since then have changed the scenes of the
  /// last drawn panels, so these must still exist.
  std::vector<Key> TakeEvents();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace upswing
