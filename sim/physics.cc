#include "sim/physics.h"

#include "core/error.h"
#include "core/text.h"
#include "sim/closed_form_physics.h"
#include "sim/mujoco_physics.h"

namespace upswing {
namespace {

struct Engine {
  PhysicsEngine engine;
  const char* name;
};
constexpr Engine kEngines[] = {{PhysicsEngine::kMuJoCo, "mujoco"},
                               {PhysicsEngine::kClosedForm, "closed-form"}};

}  // namespace

std::vector<std::string> PhysicsNames() {
  std::vector<std::string> names;
  for (const Engine& engine : kEngines) names.emplace_back(engine.name);
  return names;
}

PhysicsEngine ParsePhysics(std::string_view name, const std::string& where) {
  for (const Engine& engine : kEngines) {
    if (name == engine.name) return engine.engine;
  }
  throw BadInput(
      Concat(where, ": expected one of ", Join(PhysicsNames(), ", "), ", got \"", name, "\""));
}

std::unique_ptr<Physics> MakePhysics(const PhysicsConfig& config) {
  if (config.physics == PhysicsEngine::kMuJoCo) return std::make_unique<MuJoCoPhysics>(config);
  if (!config.mjcf.empty()) {
    throw BadInput("physics closed-form: expected the built-in model, got another MJCF model");
  }
  return std::make_unique<ClosedFormPhysics>(config);
}

}  // namespace upswing
