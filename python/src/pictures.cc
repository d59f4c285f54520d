#include "python/src/pictures.h"

#include "mujoco/painter.h"

namespace upswing {

std::span<const uint8_t> Pictures::Draw(const Plant& plant, const std::string& mjcf,
                                        const PendulumState& state, double torque) {
  PendulumScene& scene = SceneOf(plant, mjcf);
  Marks marks;
  marks.torque = torque;
  scene.Update(state, marks);
  const ScenePanel panel{&scene, "", {}};
  return offscreen_.Render(std::span(&panel, 1));
}

PendulumScene& Pictures::SceneOf(const Plant& plant, const std::string& mjcf) {
  if (scene_ == nullptr || PlantValues(scene_->plant()) != PlantValues(plant)) {
    scene_ = std::make_unique<PendulumScene>(plant, mjcf);
    scene_->SetCamera(Camera(), static_cast<double>(size().width) / size().height);
  }
  return *scene_;
}

}  // namespace upswing
