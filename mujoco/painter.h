#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>
#include <vector>

#include "mujoco/pendulum_scene.h"

namespace upswing {

/// One of the pictures that stand side by side, and what is written into it. Texts are ASCII, as
/// MuJoCo's fonts are; anything else becomes `?`.
struct ScenePanel {
  PendulumScene* scene = nullptr;
  std::string title;                               // at the top
  std::vector<std::array<std::string, 2>> status;  // at the bottom: lines of name and value
};

/// Draws scenes with MuJoCo's own renderer into the OpenGL context that this thread has now, which
/// it must have in each call.
class Painter {
 public:
  /// `buffer` is mjFB_WINDOW or mjFB_OFFSCREEN, then of this many pixels. Throws Failure.
  Painter(const mjModel& model, mjtFramebuffer buffer, int width, int height);
  ~Painter();
  Painter(const Painter&) = delete;
  Painter& operator=(const Painter&) = delete;

  /// Draws the panels in a grid over the whole of width × height pixels.
  void Draw(std::span<const ScenePanel> panels, int width, int height) const;

  /// Writes lines of name and value into a corner of a rectangle.
  void Write(mjtGridPos corner, std::span<const std::array<std::string, 2>> lines,
             mjrRect place) const;

  const mjrContext& context() const { return *context_; }

 private:
  std::unique_ptr<mjrContext> context_;
};

/// Columns of the grid that so many panels stand in, and the place of panel `index` in a picture.
int PanelColumns(int count, int width, int height);
mjrRect PanelPlace(int index, int count, int width, int height);

}  // namespace upswing
