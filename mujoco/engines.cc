#include "mujoco/engines.h"

#include "mujoco/mujoco_physics.h"

namespace upswing {

const Engine kMuJoCo{kMuJoCoName, [](const PhysicsConfig& config) -> std::unique_ptr<Physics> {
                       return std::make_unique<MuJoCoPhysics>(config);
                     }};

Engines AllEngines() {
  static constexpr const Engine* kEngines[] = {&kMuJoCo, &kClosedForm};
  return kEngines;
}

}  // namespace upswing
