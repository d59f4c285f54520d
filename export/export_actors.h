#pragma once

#include <nlohmann/json.hpp>

namespace upswing {

/// Untrained actor policies of each kind of output, as files, and what they make of observations:
/// the part `actors` of TestVectorsJson.
nlohmann::ordered_json ActorVectors();

}  // namespace upswing
