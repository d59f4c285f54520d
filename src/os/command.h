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

/// The usual name of Python 3 on this system.
extern const char* const kUsualPython;

/// Sets an environment variable, for programs that are started afterwards.
void SetEnvironment(const std::string& name, const std::string& value);

/// Path of the file of this program.
std::filesystem::path ProgramPath();
/// Path of the file with this code: the program, or the shared library of the Python package.
std::filesystem::path CodePath();

/// Path of another program of ours, in the folder of this one.
std::filesystem::path SiblingProgram(const std::string& name);

/// Continues as another program with the same command line; `words` ends with a null. Returns only
/// if that fails.
void BecomeProgram(const std::filesystem::path& program, char** words);

/// Folder of an installed program's page and examples: `share/upswing` next to the program's
/// folder. A program in a build folder has none.
std::filesystem::path SharePath();

/// Path of a file of the page, such as `agents/sac.safetensors`: in the package that contains this
/// code, or in the source repository; empty if there is none.
std::filesystem::path PageFile(const std::filesystem::path& name);

/// Whether this program is installed, not in a build folder of the source repository.
bool IsInstalled();

}  // namespace upswing
