#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sim/physics.h"

namespace upswing {

/// MuJoCo's batch interface.
extern const Engine kMuJoCo;

/// The engines' names, the default first: "mujoco", "closed-form".
std::vector<std::string> EngineNames();

/// The engine with this name. Throws BadInput whose message begins with `where`.
const Engine& FindEngine(std::string_view name, const std::string& where);

}  // namespace upswing
