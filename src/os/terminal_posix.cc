#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <csignal>

#include "os/terminal.h"

namespace upswing {

void OpenStandardFiles() {
  // open() returns the lowest free number, so each file fills its own gap. It has the opposite
  // access mode, so that reading and writing still fail.
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(fd, F_GETFD) < 0) (void)!open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

char** Utf8Words(int /*argc*/, char** argv) { return argv; }

bool IsTerminal(FILE* file) { return isatty(fileno(file)) == 1; }

int TerminalWidth(int unknown) {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : unknown;
}

bool OutputIsClosed() {
  pollfd output{STDOUT_FILENO, 0, 0};
  return poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0;
}

int EndByClosedOutput() {
  std::signal(SIGPIPE, SIG_DFL);
  std::raise(SIGPIPE);
  return 128 + SIGPIPE;
}

RedirectedOutput::RedirectedOutput(int descriptor)
    : output_(dup(STDOUT_FILENO)), error_(dup(STDERR_FILENO)) {
  std::fflush(stdout);
  dup2(descriptor, STDOUT_FILENO);
  dup2(descriptor, STDERR_FILENO);
}

RedirectedOutput::~RedirectedOutput() {
  std::fflush(stdout);
  dup2(output_, STDOUT_FILENO);
  dup2(error_, STDERR_FILENO);
  close(output_);
  close(error_);
}

}  // namespace upswing
