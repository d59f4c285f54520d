#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mujoco/model.h"
#include "sim/double_pendulum.h"

namespace upswing {

/// From where a picture is taken, seen by a camera that looks at a point above or below the pivot.
struct Camera {
  double azimuth = 80;    // deg; 90: along +y, so that positive angles turn clockwise
  double elevation = -8;  // deg; negative: from above
  double distance = 0;    // m; 0: as far as shows the whole of what the links can reach
  double look_at_z = 0;   // m over the pivot
};

/// What is drawn beside the links.
struct Marks {
  double torque = 0;  // of the motor, N·m: an arrow about the pivot, none for 0
  bool goal = true;   // a ring where the tip should be, green while both links are upright
  std::span<const std::array<double, 2>> trail = {};  // the tip's last places x, z (m), old to new
};

/// A double pendulum in a room with floor and light, as MuJoCo's abstract scene: no graphics yet.
/// Its model is for pictures alone, a copy of the plant's measures; the motion comes from
/// elsewhere.
class PendulumScene {
 public:
  /// The built-in model, or the loaded model of a file (`mjcf` if it is not empty), with this
  /// plant's lengths and masses. `reach` (m) is what the room is made for, at least l1 + l2.
  /// Throws BadInput as LoadModel does.
  PendulumScene(const Plant& plant, const std::string& mjcf, double reach = 0);
  ~PendulumScene();
  PendulumScene(const PendulumScene&) = delete;
  PendulumScene& operator=(const PendulumScene&) = delete;

  /// Puts the links into a state and draws the marks.
  void Update(const PendulumState& state, const Marks& marks);

  /// The torques about the joints (N·m) of a hand that pulls at a link as perturb() says.
  std::array<double, 2> PullTorques();

  /// Sets where it is seen from, in pictures of this ratio of width to height.
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
