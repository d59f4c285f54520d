#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/progress.h"
#include "judge/rollout.h"
#include "mujoco/offscreen.h"
#include "mujoco/painter.h"

/// Policies at work, to be looked at: in a window or as a recording. What is shown are the states
/// of the same episodes as `simulate` writes.
namespace upswing {

/// What a picture shows beside the pendulums.
struct ViewLook {
  Camera camera;
  bool text = true;   // names, time, torque
  bool marks = true;  // torque, goal and the tip's path
};

/// Episodes side by side in one picture.
class View {
 public:
  /// `entries` are not empty; those that stand in the picture have its `size`.
  View(const std::vector<RolloutConfig>& entries, const ViewLook& look, PictureSize size);

  std::vector<Episode>& episodes() { return episodes_; }

  /// What the picture shows after so many control steps, which were made before. The panels refer
  /// to this object's scenes.
  std::span<const ScenePanel> At(double steps);

  /// Shows this episode alone; -1: all. Moves the cameras back to where they began.
  void Show(int index, PictureSize size);
  int shown() const { return shown_; }
  /// What the torques are with which the hands pull, about the joints of an episode.
  std::array<double, 2> PullTorques(size_t index) { return scenes_[index]->PullTorques(); }
  std::vector<std::unique_ptr<PendulumScene>>& scenes() { return scenes_; }
  /// Gives an episode another policy or plant, from its present state on.
  void Replace(size_t index, RolloutConfig entry);
  ViewLook& look() { return look_; }

 private:
  int panels() const { return shown_ < 0 ? static_cast<int>(episodes_.size()) : 1; }

  ViewLook look_;
  std::vector<Episode> episodes_;
  std::vector<std::unique_ptr<PendulumScene>> scenes_;
  std::vector<ScenePanel> panels_;
  double reach_ = 0;  // m
  int shown_ = -1;
  bool small_ = false;
};

/// How a recording is made.
struct RecordConfig {
  std::string path;     // see RecordingKindOf
  double seconds = 10;  // of the episode
  double fps = -1;      // frames a second of the film; negative: 50, of a GIF 25
  double speed = 1;     // how much faster than the pendulum it is
  PictureSize size;
};

/// Records; `stopped` is asked after each frame and ends it without a file. `progress` counts
/// frames. Returns the number of frames; 0 if it was stopped.
int64_t Record(View& view, const RecordConfig& config, const std::function<bool()>& stopped,
               const Progress& progress);

}  // namespace upswing
