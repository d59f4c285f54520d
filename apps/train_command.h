#pragma once

#include <optional>
#include <string>

#include "nn/policy.h"

namespace upswing {

/// The line that trains this policy: its agent, its seed, and a flag for each setting that differs
/// from the named agent's. None if its file does not tell every setting, as one of another version.
/// Throws BadInput that begins with `where`.
std::optional<std::string> TrainCommand(const Policy& policy, const std::string& where);

}  // namespace upswing
