#include "cli/python_child.h"

#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "cli/signals.h"

namespace upswing {

PythonChild::PythonChild(std::string command, std::string program, std::string job)
    : command_(std::move(command)), socket_(-1) {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw Failure(Concat(command_, ": cannot open a socket: ", std::strerror(errno)));
  }
  socket_ = Descriptor(ends[0]);
  const Descriptor other(ends[1]);
  setenv("PYTHONSAFEPATH", "1", 1);                   // no modules from the present folder
  const char* given = std::getenv("UPSWING_PYTHON");  // a name in the PATH, or a path
  std::string python = "python3";
  if (given != nullptr && *given != '\0') python = given;
  std::string flag = "-c";
  const std::array<char*, 5> words{python.data(), flag.data(), program.data(), job.data(), nullptr};

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, other.get(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, other.get(), STDOUT_FILENO);
  // In a process group of its own: Ctrl-C reaches only this program, which then ends Python.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  const int error =
      posix_spawnp(&child_, python.c_str(), &files, &attributes, words.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error == 0) return;
  child_ = -1;
  throw Failure(Concat(command_, ": cannot run ", Printable(python), ": ", std::strerror(error),
                       ": expected Python 3; UPSWING_PYTHON names another one"));
}

PythonChild::~PythonChild() {
  if (child_ < 0) return;
  socket_ = Descriptor(-1);
  Wait();
}

std::optional<std::string> PythonChild::Next() {
  while (StopSignal() == 0) {
    const size_t end = read_.find('\n');
    if (end != std::string::npos) {
      std::string line = read_.substr(0, end);
      read_.erase(0, end + 1);
      return line;
    }
    // Wakes up in between, because a signal may arrive just before the call.
    pollfd waiting{socket_.get(), POLLIN, 0};
    if (poll(&waiting, 1, 100) <= 0) continue;
    std::array<char, 4096> buffer;
    const ssize_t got = read(socket_.get(), buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    read_.append(buffer.data(), static_cast<size_t>(got));
  }
  return std::nullopt;
}

void PythonChild::Answer(const std::string& line) {
  const std::string text = line + '\n';
  // A short line fits into the socket's buffer. If Python has ended, Next notices.
  (void)!write(socket_.get(), text.data(), text.size());
}

int PythonChild::Finish() {
  socket_ = Descriptor(-1);
  const int status = Wait();
  if (WIFSIGNALED(status)) {
    throw Failure(Concat(command_, ": Python was ended by signal ", WTERMSIG(status)));
  }
  return WEXITSTATUS(status);
}

int PythonChild::Wait() {
  int status = 0;
  while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
  return status;
}

}  // namespace upswing
