#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace upswing {

/// Output and exit status of a program.
struct CommandResult {
  int exit_code = 0;
  int signal = 0;  // signal that ended the program; 0: none
  std::string output, errors;
};

/// Runs a program from the PATH and waits for its end. The first word is its name; no shell is
/// involved. The program reads `input`. Returns nothing if there is no such program. Throws
/// Failure.
std::optional<CommandResult> RunCommand(std::vector<std::string> words,
                                        const std::string& input = "");

/// Path of the file of this program.
std::filesystem::path ProgramPath();

/// Folder of an installed program's page and examples: `share/upswing` next to the program's
/// folder. A program in a build folder has none.
std::filesystem::path SharePath();

/// Path of a file of the page, such as `agents/sac.safetensors`: in the package that contains this
/// code, or in the source repository; empty if there is none.
std::filesystem::path PageFile(const std::filesystem::path& name);

/// Whether this program is installed, not in a build folder of the source repository.
bool IsInstalled();

}  // namespace upswing
