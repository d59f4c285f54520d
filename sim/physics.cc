#include "sim/physics.h"

#include "core/error.h"
#include "core/text.h"
#include "sim/closed_form_physics.h"
#include "sim/mujoco_physics.h"

namespace upswing {

PhysicsEngine ParsePhysics(std::string_view name, const std::string& where) {
  if (name == "mujoco") return PhysicsEngine::kMuJoCo;
  if (name == "closed-form") return PhysicsEngine::kClosedForm;
  throw BadInput(Concat(where, ": expected one of mujoco, closed-form, got \"", name, "\""));
}

std::unique_ptr<Physics> MakePhysics(const PhysicsConfig& config) {
  if (config.physics == PhysicsEngine::kMuJoCo) return std::make_unique<MuJoCoPhysics>(config);
  if (!config.mjcf.empty()) {
    throw BadInput("physics closed-form: expected the built-in model, got another MJCF model");
  }
  return std::make_unique<ClosedFormPhysics>(config);
}

}  // namespace upswing
