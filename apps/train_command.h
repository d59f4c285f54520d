#pragma once

#include <optional>
#include <string>

#include "nn/policy_info.h"

namespace upswing {

/// The line, for a shell, that trains such a policy: its agent, its seed, and a flag for each
/// setting that differs from the named agent's. None if its file does not tell every setting, as
/// one of another version, or has a text among them that is none for a command line. Throws
/// BadInput that begins with `where`.
std::optional<std::string> TrainCommand(const PolicyInfo& info, const std::string& where);

}  // namespace upswing
