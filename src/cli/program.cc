#include "cli/program.h"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <system_error>

#include "base/error.h"
#include "base/simd.h"
#include "base/text.h"
#include "cli/say.h"
#include "cli/signals.h"
#include "os/command.h"
#include "os/file.h"

namespace upswing {
namespace {

/// Whether standard output has no reader any more, as after `| head -1` has ended.
bool OutputIsClosed() {
  pollfd output{STDOUT_FILENO, 0, 0};
  return poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0;
}

/// Ends quietly by SIGPIPE, as programs usually do when nobody reads their output.
int EndByPipe() {
  std::signal(SIGPIPE, SIG_DFL);
  std::raise(SIGPIPE);
  return 128 + SIGPIPE;
}

/// The exit code; another one if the output cannot be written.
int Finish(int exit_code) {
  std::cout.flush();
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good()) return exit_code;
  if (OutputIsClosed()) return EndByPipe();
  SayError(Concat("cannot write the output: ", std::strerror(errno)));
  return 1;
}

/// Selects the vector instructions named in the environment variable UPSWING_VECTORS, if it is set.
/// They reproduce the results of another processor to the bit.
void ChooseVectors() {
  const char* path = std::getenv("UPSWING_VECTORS");
  if (path != nullptr && *path != '\0') UseSimdPath(path);
}

/// Runs a command that is a separate program: `upswing-NAME` in the same folder.
void ReplaceByProgramOf(const std::string& command, char** argv) {
  const std::filesystem::path program = ProgramPath().parent_path() / Concat("upswing-", command);
  execv(program.c_str(), argv);
  throw BadInput(
      Concat(command, ": only the source repository has this command: ./upswing ", command));
}

int Main(int argc, char** argv, std::span<const CommandEntry> commands, const std::string& footer) {
  try {
    for (const CommandEntry& command : commands) {
      if (command.declare == nullptr && argc > 1 && command.name == std::string_view(argv[1])) {
        ReplaceByProgramOf(command.name, argv);
      }
    }
    ChooseVectors();
    return Finish(RunProgram(argc, argv, commands, footer));
  } catch (const Error& error) {
    SayError(OneLine(error.what()));
    return error.exit_code();
  } catch (const std::filesystem::filesystem_error& error) {
    const Error of_path = PathError("cannot use", error.path1(), error.code().value());
    SayError(OneLine(of_path.what()));
    return of_path.exit_code();
  } catch (const std::bad_alloc&) {
    SayError("out of memory");
    return 1;
  } catch (const std::exception& error) {
    if (OutputIsClosed() && std::ferror(stdout) != 0) return EndByPipe();
    SayError(OneLine(error.what()));
    return 1;
  }
}

}  // namespace

int MainProgram(int argc, char** argv, std::span<const CommandEntry> commands,
                const std::string& footer) {
  ListenToSignals();
  OpenStandardFiles();
  // A failed write then returns an error, which gets a message, instead of ending the program.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  return Main(argc, argv, commands, footer);
}

}  // namespace upswing
