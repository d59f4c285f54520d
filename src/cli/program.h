#pragma once

#include <span>
#include <string>

#include "cli/command_line.h"

namespace upswing {

/// The main function of our programs: handles signals, runs the given command and reports errors in
/// one line. A command without a declaration is the program `upswing-NAME` in the same folder.
/// Returns the exit code.
int MainProgram(int argc, char** argv, std::span<const CommandEntry> commands,
                const std::string& footer);

}  // namespace upswing
