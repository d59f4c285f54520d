#include "mujoco/engines.h"

#include "core/error.h"
#include "core/text.h"
#include "mujoco/mujoco_physics.h"

namespace upswing {
namespace {

constexpr const Engine* kEngines[] = {&kMuJoCo, &kClosedForm};

}  // namespace

const Engine kMuJoCo{"mujoco", [](const PhysicsConfig& config) -> std::unique_ptr<Physics> {
                       return std::make_unique<MuJoCoPhysics>(config);
                     }};

std::vector<std::string> EngineNames() {
  std::vector<std::string> names;
  for (const Engine* engine : kEngines) names.emplace_back(engine->name);
  return names;
}

const Engine& FindEngine(std::string_view name, const std::string& where) {
  for (const Engine* engine : kEngines) {
    if (name == engine->name) return *engine;
  }
  throw BadInput(
      Concat(where, ": expected one of ", Join(EngineNames(), ", "), ", got \"", name, "\""));
}

}  // namespace upswing
