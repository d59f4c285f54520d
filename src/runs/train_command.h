#pragma once

#include <optional>
#include <string>

#include "base/policy_info.h"

namespace upswing {

/// The shell command that trains a policy like this: its agent, its seed, and a flag per setting
/// that differs from the named agent's.
///
/// Nothing if the policy's file lacks a setting, as files of other versions may, or if its agent was
/// removed. Nothing if a setting's text does not fit on a command line. Throws BadInput that begins with `where`.
std::optional<std::string> TrainCommand(const PolicyInfo& info, const std::string& where);

}  // namespace upswing
