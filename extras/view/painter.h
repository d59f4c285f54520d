#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>
#include <vector>

#include "extras/view/pendulum_scene.h"

namespace upswing {

/// One of several pictures drawn next to each other, and its texts. Texts are ASCII, as MuJoCo's
/// fonts are; other characters become `?`.
struct ScenePanel {
  PendulumScene* scene = nullptr;
  std::string title;                               // at the top
  std::vector<std::array<std::string, 2>> status;  // at the bottom: lines of name and value
};

/// Draws scenes with MuJoCo's renderer into the thread's current OpenGL context. The thread must
/// have this context in each call.
class Painter {
 public:
  /// `buffer` is mjFB_WINDOW, or mjFB_OFFSCREEN with this size in pixels. Throws Failure.
  Painter(const mjModel& model, mjtFramebuffer buffer, int width, int height);
  ~Painter();
  Painter(const Painter&) = delete;
  Painter& operator=(const Painter&) = delete;

  /// Draws the panels in a grid over a picture of width × height pixels.
  void Draw(std::span<const ScenePanel> panels, int width, int height) const;

  /// Writes lines of name and value into a corner of a rectangle.
  void Write(mjtGridPos corner, std::span<const std::array<std::string, 2>> lines,
             mjrRect place) const;

  const mjrContext& context() const { return *context_; }

 private:
  std::unique_ptr<mjrContext> context_;
};

/// Number of columns of a grid with `count` panels, and the rectangle of panel `index` in a
/// picture.
int PanelColumns(int count, int width, int height);
mjrRect PanelPlace(int index, int count, int width, int height);

}  // namespace upswing
