#pragma once

#include <span>
#include <string>

#include "apps/command_line.h"

namespace upswing {

/// What the main function of a program of ours does: handles signals, runs the command that was
/// typed and reports errors in one line. A command without a declaration is the program
/// `upswing-NAME` beside this one. Returns the exit code.
int MainProgram(int argc, char** argv, std::span<const CommandEntry> commands,
                const std::string& footer);

}  // namespace upswing
