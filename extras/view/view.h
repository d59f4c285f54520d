#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/progress.h"
#include "extras/view/offscreen.h"
#include "extras/view/painter.h"
#include "judge/rollout.h"

/// Displays policies at work, in a window or as a recording. It shows the states of the same
/// episodes that `simulate` writes.
namespace upswing {

/// Parts of a picture that can be switched off.
struct ViewLook {
  Camera camera;
  bool text = true;   // names, time, torque
  bool marks = true;  // torque, goal and the tip's path
};

/// Episodes next to each other in one picture.
class View {
 public:
  /// `entries` must not be empty. The picture with all of them has `size`.
  View(const std::vector<RolloutConfig>& entries, const ViewLook& look, PictureSize size);

  std::vector<Episode>& episodes() { return episodes_; }

  /// The panels of the picture after `steps` control steps, which must already be computed. The
  /// panels refer to this object's scenes.
  std::span<const ScenePanel> At(double steps);

  /// Shows only this episode; -1: all. Resets the cameras.
  void Show(int index, PictureSize size);
  int shown() const { return shown_; }
  /// Torques of the mouse that pulls at an episode's links, about its joints, N·m.
  std::array<double, 2> PullTorques(size_t index) { return scenes_[index]->PullTorques(); }
  std::vector<std::unique_ptr<PendulumScene>>& scenes() { return scenes_; }
  /// Gives an episode another policy or plant; the new episode starts in the entry's state.
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

/// Settings of a recording.
struct RecordConfig {
  std::string path;     // see RecordingKindOf
  double seconds = 10;  // of the episode
  double fps = -1;      // film's frames per second; negative: 50, for a GIF 25
  double speed = 1;     // speed of the film relative to the pendulum
  PictureSize size;
};

/// Records a film or picture. Checks `stopped` after each frame; if it is true, ends without a
/// file. `progress` counts frames. Returns the number of frames; 0 if it was stopped.
int64_t Record(View& view, const RecordConfig& config, const std::function<bool()>& stopped,
               const Progress& progress);

}  // namespace upswing
