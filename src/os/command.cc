#include "os/command.h"

#include <dlfcn.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

/// Folder of the page and the examples, if this program is installed.
std::filesystem::path ShareOf(const std::filesystem::path& program) {
  return program.parent_path().parent_path() / "share/upswing";
}

Error SystemFailure(std::string_view what) {
  return Failure(Concat("cannot ", what, ": ", std::strerror(errno)));
}

/// A nameless temporary file. Three pipes could block each other; three files cannot.
class Scratch {
 public:
  Scratch() : file_(std::tmpfile(), &std::fclose) {
    if (!file_) throw SystemFailure("make a temporary file");
  }
  int descriptor() const { return fileno(file_.get()); }

  /// Writes the text and goes back to the beginning of the file.
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

}  // namespace

std::optional<CommandResult> RunCommand(std::vector<std::string> words, const std::string& input) {
  Scratch in, out, errors;
  in.Fill(input);
  FileActions actions;
  actions.Give(in, STDIN_FILENO);
  actions.Give(out, STDOUT_FILENO);
  actions.Give(errors, STDERR_FILENO);

  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, arguments[0], actions.get(), nullptr, arguments.data(), environ);
  if (error == ENOENT) return std::nullopt;
  if (error != 0) throw Failure(Concat("cannot run ", words[0], ": ", std::strerror(error)));

  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) throw SystemFailure(Concat("wait for ", words[0]));
  }
  CommandResult result{0, 0, out.Read(), errors.Read()};
  if (WIFSIGNALED(status)) {
    result.signal = WTERMSIG(status);
  } else {
    result.exit_code = WEXITSTATUS(status);
  }
  return result;
}

std::filesystem::path ProgramPath() { return std::filesystem::read_symlink("/proc/self/exe"); }

std::filesystem::path PageFile(const std::filesystem::path& name) {
  // The Python package is a shared library in another program. The program itself may have a
  // relative path here.
  Dl_info code{};
  dladdr(reinterpret_cast<const void*>(&PageFile), &code);
  std::filesystem::path folder = code.dli_fname != nullptr ? code.dli_fname : "";
  if (!folder.is_absolute()) folder = ProgramPath();
  // Up to the source repository, from build/release/python/upswing.
  constexpr int kMostParents = 5;
  for (int parent = 0; parent < kMostParents; ++parent) {
    folder = folder.parent_path();
    for (const char* page : {"share/upswing/page", "web/public"}) {
      std::error_code none;
      if (std::filesystem::exists(folder / page / name, none)) return folder / page / name;
    }
  }
  return {};
}

std::filesystem::path SharePath() { return ShareOf(ProgramPath()); }

bool IsInstalled() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return !error && std::filesystem::is_directory(ShareOf(program), error);
}

}  // namespace upswing
