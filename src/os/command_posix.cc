#include <dlfcn.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "base/error.h"
#include "base/text.h"
#include "os/command.h"

namespace upswing {
namespace {

Error SystemFailure(std::string_view what) {
  return Failure(Concat("cannot ", what, ": ", std::strerror(errno)));
}

using File = std::unique_ptr<FILE, int (*)(FILE*)>;

/// Makes a nameless temporary file with this text. Three pipes could block each other; three files
/// cannot.
File Scratch(const std::string& text) {
  File file(std::tmpfile(), &std::fclose);
  if (!file) throw SystemFailure("make a temporary file");
  std::fwrite(text.data(), 1, text.size(), file.get());
  if (std::fflush(file.get()) != 0 || std::ferror(file.get()) != 0) {
    throw SystemFailure("write a temporary file");
  }
  std::rewind(file.get());
  return file;
}

std::string ReadAll(const File& file) {
  std::fseek(file.get(), 0, SEEK_END);
  std::string text(static_cast<size_t>(std::ftell(file.get())), '\0');
  std::rewind(file.get());
  text.resize(std::fread(text.data(), 1, text.size(), file.get()));
  return text;
}

}  // namespace

std::optional<CommandResult> RunCommand(std::vector<std::string> words, const std::string& input) {
  const std::array<File, 3> files{Scratch(input), Scratch(""), Scratch("")};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (int i = 0; i < 3; ++i) {  // standard input, output and error
    posix_spawn_file_actions_adddup2(&actions, fileno(files.at(i).get()), i);
  }
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error == ENOENT) return std::nullopt;
  if (error != 0) throw Failure(Concat("cannot run ", words[0], ": ", std::strerror(error)));

  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) throw SystemFailure(Concat("wait for ", words[0]));
  }
  CommandResult result{0, 0, ReadAll(files[1]), ReadAll(files[2])};
  if (WIFSIGNALED(status)) {
    result.signal = WTERMSIG(status);
  } else {
    result.exit_code = WEXITSTATUS(status);
  }
  return result;
}

const char* const kUsualPython = "python3";

void SetEnvironment(const std::string& name, const std::string& value) {
  setenv(name.c_str(), value.c_str(), 1);
}

std::filesystem::path ProgramPath() { return std::filesystem::read_symlink("/proc/self/exe"); }

std::filesystem::path SiblingProgram(const std::string& name) {
  return ProgramPath().replace_filename(name);
}

std::filesystem::path CodePath() {
  Dl_info code{};
  dladdr(reinterpret_cast<const void*>(&CodePath), &code);
  std::filesystem::path path = code.dli_fname != nullptr ? code.dli_fname : "";
  return path.is_absolute() ? path : ProgramPath();
}

void BecomeProgram(const std::filesystem::path& program, char** words) {
  execv(program.c_str(), words);
}

}  // namespace upswing
