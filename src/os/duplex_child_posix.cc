#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "os/duplex_child.h"
#include "os/making.h"

namespace upswing {

struct DuplexChild::Process {
  Descriptor socket{-1};
  pid_t pid = -1;
};

DuplexChild::DuplexChild(std::vector<std::string> words) : process_(std::make_unique<Process>()) {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw Failure(Concat("cannot open a socket: ", std::strerror(errno)));
  }
  process_->socket = Descriptor(ends[0]);
  const Descriptor other(ends[1]);
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, other.get(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, other.get(), STDOUT_FILENO);
  // In a process group of its own: Ctrl-C reaches only this program, which then ends the other.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  const int error =
      posix_spawnp(&process_->pid, pointers[0], &files, &attributes, pointers.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error == 0) return;
  process_.reset();
  throw Failure(std::strerror(error));
}

DuplexChild::~DuplexChild() {
  if (process_) Finish();
}

std::optional<size_t> DuplexChild::Read(std::span<char> buffer,
                                        std::chrono::milliseconds patience) {
  pollfd waiting{process_->socket.get(), POLLIN, 0};
  if (poll(&waiting, 1, static_cast<int>(patience.count())) <= 0) return 0;
  const ssize_t got = read(process_->socket.get(), buffer.data(), buffer.size());
  if (got < 0 && errno == EINTR) return 0;
  if (got <= 0) return std::nullopt;
  return static_cast<size_t>(got);
}

void DuplexChild::Write(std::string_view text) {
  (void)!write(process_->socket.get(), text.data(), text.size());
}

DuplexChild::End DuplexChild::Finish() {
  process_->socket = Descriptor(-1);
  int status = 0;
  while (waitpid(process_->pid, &status, 0) < 0 && errno == EINTR) {
  }
  process_.reset();
  if (WIFSIGNALED(status)) return {0, WTERMSIG(status)};
  return {WEXITSTATUS(status), 0};
}

}  // namespace upswing
