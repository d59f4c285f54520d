#pragma once

#include <span>

#include "cli/command_line.h"

namespace upswing {

/// The main function of our programs: handles signals, runs the called command and reports errors
/// in one line. Commands other than the program's `own` are run by the program of their row in the
/// table of commands, in the same folder. Returns the exit code.
int MainProgram(int argc, char** argv, std::span<const Command> own);

}  // namespace upswing
