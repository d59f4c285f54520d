#include "cli/say.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>

#include "os/command.h"

namespace upswing {

void OpenStandardFiles() {
  // open() returns the lowest free number, so each file fills its own gap. It has the opposite
  // access mode, so that reading and writing still fail.
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(fd, F_GETFD) < 0) (void)!open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

std::string_view LaunchCommand() { return IsInstalled() ? "upswing" : "./upswing"; }

void SayText(std::string_view text) { std::fwrite(text.data(), 1, text.size(), stdout); }

void SayError(std::string_view message) noexcept {
  // One call per message, so that processes with the same standard error do not mix within a line.
  std::fprintf(stderr, "upswing: %.*s\n", static_cast<int>(message.size()), message.data());
}

}  // namespace upswing
