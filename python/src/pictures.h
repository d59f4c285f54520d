#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "mujoco/offscreen.h"
#include "sim/double_pendulum.h"

namespace upswing {

/// Draws double pendulums of any plant, one at a time.
class Pictures {
 public:
  /// Throws BadInput if a size is out of range, and Failure where nothing can be drawn.
  explicit Pictures(PictureSize size) : offscreen_(size) {}

  PictureSize size() const { return offscreen_.size(); }

  /// The picture of a pendulum (of the built-in model if `mjcf` is empty) in a state, under a
  /// torque, N·m: see Offscreen::Render.
  std::span<const uint8_t> Draw(const Plant& plant, const std::string& mjcf,
                                const PendulumState& state, double torque);

 private:
  /// The scene of this plant: the last one or a new one.
  PendulumScene& SceneOf(const Plant& plant, const std::string& mjcf);

  Offscreen offscreen_;
  std::unique_ptr<PendulumScene> scene_;
};

}  // namespace upswing
