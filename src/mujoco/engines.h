#pragma once

#include <string>
#include <string_view>

#include "pendulum/physics.h"

namespace upswing {

/// The engine that uses MuJoCo's batch interface.
extern const Engine kMuJoCo;

/// All engines of the program: MuJoCo and the closed form.
Engines AllEngines();

/// The engine of AllEngines with this name. Throws BadInput with a message that begins with
/// `where`.
inline const Engine& FindEngine(std::string_view name, const std::string& where) {
  return FindEngine(AllEngines(), name, where);
}

}  // namespace upswing
