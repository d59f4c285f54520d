#pragma once

#include <optional>
#include <string>

#include "core/policy_info.h"

namespace upswing {

/// The line, for a shell, that trains such a policy: its agent, its seed, and a flag for each
/// setting that differs from the named agent's. None if its file
/// lacks a setting, as one of another version, or has one whose text is unfit for a command line.
/// Throws BadInput that begins with `where`.
std::optional<std::string> TrainCommand(const PolicyInfo& info, const std::string& where);

}  // namespace upswing
