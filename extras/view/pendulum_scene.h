#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mujoco/model.h"
#include "pendulum/task.h"

namespace upswing {

/// A camera that looks at a point above or below the pivot.
struct Camera {
  double azimuth = 80;    // deg; 90: along +y, so that positive angles turn clockwise
  double elevation = -8;  // deg; negative: from above
  double distance = 0;    // m; 0: far enough to show everything that the links can reach
  double look_at_z = 0;   // m over the pivot
};

/// Marks drawn in addition to the links.
struct Marks {
  double torque = 0;  // motor torque, N·m: an arrow about the pivot, none for 0
  bool goal = true;   // a ring where the tip should be, green while both links are upright
  std::span<const std::array<double, 2>> trail = {};  // past tip positions x, z (m), old to new
};

/// A double pendulum in a room with floor and light, as MuJoCo's abstract scene without graphics.
/// Its model is a copy of the plant's dimensions, only for pictures; it does not compute the
/// motion.
class PendulumScene {
 public:
  /// Uses the built-in model, or the model of a file (`mjcf` if it is not empty), with this plant's
  /// lengths and masses. `reach` (m) sets the size of the room, at least l1 + l2. Throws BadInput
  /// as LoadModel does.
  PendulumScene(const Plant& plant, const std::string& mjcf, double reach = 0);
  ~PendulumScene();
  PendulumScene(const PendulumScene&) = delete;
  PendulumScene& operator=(const PendulumScene&) = delete;

  /// Sets the links' state and draws the marks.
  void Update(const PendulumState& state, const Marks& marks);

  /// Joint torques (N·m) of the mouse that pulls at a link, as perturb() defines it.
  std::array<double, 2> PullTorques();

  /// Sets the camera for pictures with this ratio of width to height.
  void SetCamera(const Camera& camera, double aspect);

  mjModel& model() { return *model_; }
  mjData& data() { return *data_; }
  mjvScene& scene() { return scene_; }
  mjvCamera& camera() { return camera_; }
  mjvOption& option() { return option_; }
  mjvPerturb& perturb() { return perturb_; }
  const Plant& plant() const { return plant_; }

 private:
  void AddGoal(const PendulumState& state);
  void AddTorque(double torque, const PendulumState& state);
  void AddTrail(std::span<const std::array<double, 2>> trail);

  Plant plant_;
  double reach_;  // m
  ModelPtr model_;
  DataPtr data_;
  mjvScene scene_;
  mjvCamera camera_;
  mjvOption option_;
  mjvPerturb perturb_;
};

}  // namespace upswing
