#pragma once

#include <string>
#include <string_view>

#include "sim/physics.h"

namespace upswing {

/// MuJoCo's batch interface.
extern const Engine kMuJoCo;

/// Those of the program: MuJoCo's and the closed form.
Engines AllEngines();

/// The one of them with this name. Throws BadInput whose message begins with `where`.
inline const Engine& FindEngine(std::string_view name, const std::string& where) {
  return FindEngine(AllEngines(), name, where);
}

}  // namespace upswing
