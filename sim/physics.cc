#include "sim/physics.h"

#include "core/error.h"
#include "core/text.h"

namespace upswing {

std::vector<std::string> EngineNames() { return {kMuJoCoName, kClosedForm.name}; }

const Engine& FindEngine(Engines engines, std::string_view name, const std::string& where) {
  std::vector<std::string> names;
  for (const Engine* engine : engines) {
    if (name == engine->name) return *engine;
    names.emplace_back(engine->name);
  }
  throw BadInput(
      Concat(where, ": expected one of ", Join(names, ", "), ", got \"", name, "\""));
}

void Physics::Push(int /*env*/, const std::array<double, 2>& /*torque*/) {
  throw Failure("this engine knows no pushes; mujoco does");
}

}  // namespace upswing
