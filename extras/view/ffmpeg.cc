#include "extras/view/ffmpeg.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

constexpr int kOutput = 3;  // the file that it writes, as its own descriptor

Error FilmFailure(std::string_view what) {
  return Failure(Concat("film: cannot ", what, ": ", std::strerror(errno)));
}

/// The last line of ffmpeg's messages.
std::string LastLine(int file) {
  std::string text(4096, '\0');
  const off_t end = lseek(file, 0, SEEK_END);
  const off_t begin = end > 4096 ? end - 4096 : 0;
  const ssize_t got = pread(file, text.data(), text.size(), begin);
  text.resize(got > 0 ? static_cast<size_t>(got) : 0);
  std::string last;
  for (const std::string_view line : Split(text, '\n')) {
    if (!line.empty()) last = line;
  }
  return last.empty() ? "it said nothing" : last;
}

}  // namespace

Ffmpeg::Ffmpeg(const std::vector<std::string>& words, int output)
    : input_(-1), errors_(memfd_create("ffmpeg", MFD_CLOEXEC)) {
  std::array<int, 2> pipe_ends{};
  if (errors_.get() < 0 || pipe2(pipe_ends.data(), O_CLOEXEC) != 0) {
    throw FilmFailure("open a pipe to ffmpeg");
  }
  const Descriptor read_end(pipe_ends[0]);
  input_ = Descriptor(pipe_ends[1]);

  std::vector<std::string> texts{"ffmpeg", "-nostdin", "-hide_banner", "-loglevel", "error", "-y"};
  texts.insert(texts.end(), words.begin(), words.end());
  texts.push_back(Concat("file:/proc/self/fd/", kOutput));
  std::vector<char*> arguments;
  for (std::string& text : texts) arguments.push_back(text.data());
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, read_end.get(), STDIN_FILENO);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&files, errors_.get(), STDERR_FILENO);
  posix_spawn_file_actions_adddup2(&files, output, kOutput);
  // ffmpeg gets its own process group, so that Ctrl-C in a terminal reaches only this program.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t usual;
  sigemptyset(&usual);
  sigaddset(&usual, SIGPIPE);
  sigaddset(&usual, SIGXFSZ);
  posix_spawnattr_setsigdefault(&attributes, &usual);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
  const int error = posix_spawnp(&child_, "ffmpeg", &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error == 0) return;
  child_ = -1;
  if (error == ENOENT) {
    throw Failure(
        "film: expected the program ffmpeg (Debian's package ffmpeg), found none in PATH; FILE.png "
        "and FOLDER/ need no ffmpeg");
  }
  throw Failure(Concat("film: cannot run ffmpeg: ", std::strerror(error)));
}

Ffmpeg::~Ffmpeg() {
  if (child_ < 0) return;
  kill(child_, SIGKILL);
  Wait();
}

int Ffmpeg::Wait() {
  int status = 0;
  while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
  return status;
}

void Ffmpeg::Fail(int status) {
  if (WIFSIGNALED(status)) {
    throw Failure(Concat("film: ffmpeg was ended by signal ", WTERMSIG(status)));
  }
  throw Failure(Concat("film: ffmpeg failed: ", Printable(LastLine(errors_.get()))));
}

void Ffmpeg::Write(std::span<const uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(input_.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0 && errno == EPIPE) {
      input_ = Descriptor(-1);
      Fail(Wait());
    }
    if (written < 0) throw FilmFailure("write to ffmpeg");
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
}

void Ffmpeg::Finish() {
  input_ = Descriptor(-1);  // the end of its input
  const int status = Wait();
  if (status != 0) Fail(status);
}

}  // namespace upswing
