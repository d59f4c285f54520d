#include "apps/say.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>

namespace upswing {

void OpenStandardFiles() {
  // The lowest free number is taken, so that each fills its own gap. Opened for the opposite
  // access, so that reading and writing fail as before.
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(fd, F_GETFD) < 0) (void)!open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

void SayText(std::string_view text) { std::fwrite(text.data(), 1, text.size(), stdout); }

void SayError(std::string_view message) noexcept {
  // In one piece, so that processes with the same standard error do not mix within a line.
  std::fprintf(stderr, "upswing: %.*s\n", static_cast<int>(message.size()), message.data());
}

}  // namespace upswing
