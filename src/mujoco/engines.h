#pragma once

#include <string_view>

#include "pendulum/physics.h"

namespace upswing {

/// The engine that uses MuJoCo's batch interface.
extern const Engine kMuJoCo;

/// The engine of this name, one of EngineNames().
inline const Engine& EngineCalled(std::string_view name) {
  return name == kMuJoCo.name ? kMuJoCo : kClosedForm;
}

}  // namespace upswing
