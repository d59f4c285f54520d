#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "judge/rollout.h"
#include "mujoco/offscreen.h"
#include "mujoco/painter.h"
#include "setup/loaded_policy.h"

/// Policies at work, to be looked at: in a window or as a recording. What is shown are the states
/// of the same episodes as `simulate` writes.
namespace upswing {

/// A policy and the episode that it is shown in.
struct ViewEntry {
  std::string title;
  const Policy* policy = nullptr;            // none: nothing turns the motor
  EnvConfig env;                             // of the double pendulum, one environment
  std::optional<std::vector<double>> start;  // (S) as in RolloutConfig
};

/// One of them as it goes on: everything up to now, and the pendulum that is drawn.
class ViewEpisode {
 public:
  explicit ViewEpisode(ViewEntry entry);

  /// One control step; `motor` as in Episode::Step, and somebody turns the joints by `push`, N·m.
  /// Throws Failure if the state blows up, or if there is a push in physics that know none.
  void Step(bool motor = true, const std::array<double, 2>& push = {});

  /// Goes back to the state after so many of these steps, as they were.
  void GoBack(int64_t steps);

  /// Begins anew: another policy takes over where this one is, or another plant is there.
  void Replace(ViewEntry entry);

  /// The control steps that were made. Their rows are 0 to this number less one.
  int64_t steps() const { return static_cast<int64_t>(rows_.size()); }
  const std::vector<RolloutRow>& rows() const { return rows_; }
  /// What `simulate` calls it.
  Rollout rollout() const;
  const ViewEntry& entry() const { return entry_; }
  Plant plant() const { return episode_->pendulum()->plant(0); }
  PendulumEnv& env() { return *episode_->pendulum(); }
  Disturbance disturbance() const { return episode_->pendulum()->disturbance(0); }

  /// The state after so many control steps, with a fraction: between two of them along the cubic
  /// that has their angles and velocities. At most steps().
  PendulumState StateAt(double steps) const;
  /// The motor's torque then.
  double TorqueAt(double steps) const;

 private:
  PendulumState StateOfRow(int64_t k) const;

  /// What a step was made with.
  struct Input {
    bool motor;
    std::array<double, 2> push;
  };

  ViewEntry entry_;
  std::unique_ptr<Episode> episode_;
  std::vector<RolloutRow> rows_;
  std::vector<Input> inputs_;  // of each of them
};

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
  View(const std::vector<ViewEntry>& entries, const ViewLook& look, PictureSize size);

  std::vector<ViewEpisode>& episodes() { return episodes_; }

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
  void Replace(size_t index, ViewEntry entry);
  ViewLook& look() { return look_; }

 private:
  int panels() const { return shown_ < 0 ? static_cast<int>(episodes_.size()) : 1; }

  ViewLook look_;
  std::vector<ViewEpisode> episodes_;
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
  double fps = 0;       // frames a second of the film
  double speed = 1;     // how much faster than the pendulum it is
  PictureSize size;
  std::string flag = "--record";  // in messages
};

/// What a film's frames a second are if nobody says.
double UsualFps(const std::string& path);

/// Records; `stopped` is asked after each frame and ends it without a file. `progress` counts
/// frames. Returns the number of frames; 0 if it was stopped.
int64_t Record(View& view, const RecordConfig& config, const std::function<bool()>& stopped,
               const Progress& progress);

}  // namespace upswing
