#pragma once

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mujoco/offscreen.h"
#include "mujoco/painter.h"

namespace upswing {

/// A key that was pressed: a letter or digit as the character (upper case), or one of these.
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

/// A window with MuJoCo's own rendering; its mouse moves the cameras, selects links and pulls at
/// them as MuJoCo's `simulate` does. By GLFW; there can be one at a time, in the main thread.
class Window {
 public:
  /// Throws Failure where no window can be opened.
  Window(const std::string& title, PictureSize size);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Whether the user has closed it.
  bool closed() const;
  void SetTitle(const std::string& title);
  void ToggleFullScreen();
  /// Its present size, pixels.
  PictureSize size() const;

  /// Draws the panels and what is written over them; `chart` may be null.
  void Draw(std::span<const ScenePanel> panels, std::span<const Overlay> overlays,
            mjvFigure* chart);

  /// The keys that were pressed since the last call. The mouse has moved the scenes of the panels
  /// that were drawn last, which must still be there.
  std::vector<Key> TakeEvents();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace upswing
