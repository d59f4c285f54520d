#include "report/gnuplot.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

Error SystemFailure(std::string_view what) {
  return Failure(Concat("figure: cannot ", what, ": ", std::strerror(errno)));
}

/// A nameless temporary file. Unlike pipes, three of them cannot block.
class Scratch {
 public:
  Scratch() : file_(std::tmpfile(), &std::fclose) {
    if (!file_) throw SystemFailure("make a temporary file");
  }
  int descriptor() const { return fileno(file_.get()); }

  /// Writes all of it and goes back to the beginning.
  void Fill(const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), file_.get());
    if (std::fflush(file_.get()) != 0 || std::ferror(file_.get()) != 0) {
      throw SystemFailure("write a temporary file");
    }
    std::rewind(file_.get());
  }

  std::string Read() {
    std::rewind(file_.get());
    std::string text;
    std::array<char, 65536> buffer;
    while (const size_t got = std::fread(buffer.data(), 1, buffer.size(), file_.get())) {
      text.append(buffer.data(), got);
    }
    return text;
  }

 private:
  std::unique_ptr<FILE, int (*)(FILE*)> file_;
};

/// The standard input, output and error of a child process.
class FileActions {
 public:
  FileActions() { posix_spawn_file_actions_init(&actions_); }
  ~FileActions() { posix_spawn_file_actions_destroy(&actions_); }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;
  void Give(const Scratch& file, int as) {
    posix_spawn_file_actions_adddup2(&actions_, file.descriptor(), as);
  }
  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

/// The line of gnuplot's message with the error, without its place in the script.
std::string ErrorIn(const std::string& message) {
  std::string last;
  for (const std::string_view line : Split(message, '\n')) {
    if (!line.empty()) last = line;
    if (const size_t colon = line.find(": "); line.starts_with('"') && colon != line.npos) {
      return std::string(line.substr(colon + 2));
    }
  }
  return last.empty() ? "it said nothing" : last;
}

}  // namespace

std::string RunGnuplot(const std::string& script) {
  Scratch input, output, errors;
  input.Fill(script);
  FileActions actions;
  actions.Give(input, STDIN_FILENO);
  actions.Give(output, STDOUT_FILENO);
  actions.Give(errors, STDERR_FILENO);

  std::array<std::string, 3> words{"gnuplot", "-d", "-"};
  std::array<char*, 4> arguments{words[0].data(), words[1].data(), words[2].data(), nullptr};
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, "gnuplot", actions.get(), nullptr, arguments.data(), environ);
  if (error == ENOENT) {
    throw Failure(
        "figure: expected the program gnuplot (Debian's package gnuplot-nox), found none in PATH");
  }
  if (error != 0) throw Failure(Concat("figure: cannot run gnuplot: ", std::strerror(error)));

  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) throw SystemFailure("wait for gnuplot");
  }
  if (WIFSIGNALED(status)) {
    throw Failure(Concat("figure: gnuplot was ended by signal ", WTERMSIG(status)));
  }
  if (WEXITSTATUS(status) != 0) {
    throw Failure(Concat("figure: gnuplot failed: ", ErrorIn(errors.Read())));
  }
  return output.Read();
}

}  // namespace upswing
