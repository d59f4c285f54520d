#include <fcntl.h>
#include <sys/auxv.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "os/child_process.h"
#include "os/file.h"

namespace upswing {
namespace {

/// Runs in the new process, which becomes the program or ends with 127. Only plain system calls are
/// safe between fork and exec.
[[noreturn]] void BecomeProgram(const char* program, char* const* arguments, int log,
                                pid_t parent) {
  // Keep this order: getppid notices a parent that died before the call of prctl.
  const bool tied = prctl(PR_SET_PDEATHSIG, SIGKILL) == 0 && getppid() == parent;
  setpgid(0, 0);
  // Ignore SIGUSR1, which would kill the process, until the program handles it.
  std::signal(SIGUSR1, SIG_IGN);
  const int nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (tied && nothing >= 0 && dup2(nothing, STDIN_FILENO) >= 0 && dup2(log, STDOUT_FILENO) >= 0 &&
      dup2(log, STDERR_FILENO) >= 0) {
    execv("/proc/self/exe", arguments);  // runs this program even if its file was replaced
    execv(program, arguments);           // for systems without /proc
    constexpr char kNotice[] = "upswing: cannot start itself\n";
    (void)!write(STDERR_FILENO, kNotice, sizeof(kNotice) - 1);
  }
  _exit(127);
}

pid_t Pid(int64_t pid) { return static_cast<pid_t>(pid); }

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& arguments,
                           const std::filesystem::path& log) {
  std::vector<std::string> texts{"upswing"};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  const AppendFile log_file(log);
  // The path by which this process was started.
  // NOLINTNEXTLINE(performance-no-int-to-ptr): the system hands it over as a number
  const auto* program = reinterpret_cast<const char*>(getauxval(AT_EXECFN));
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ == 0) BecomeProgram(program, pointers.data(), log_file.descriptor(), parent);
  if (pid_ < 0) throw Failure(Concat("cannot start a process: ", std::strerror(errno)));
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept : pid_(std::exchange(other.pid_, -1)) {}

ChildProcess::~ChildProcess() {
  if (pid_ < 0) return;
  kill(Pid(pid_), SIGKILL);
  while (waitpid(Pid(pid_), nullptr, 0) < 0 && errno == EINTR) {
  }
}

void ChildProcess::Signal(int signal) const {
  if (pid_ >= 0) kill(Pid(pid_), signal);
}

std::optional<int> ChildProcess::Poll() {
  int status = 0;
  if (waitpid(Pid(pid_), &status, WNOHANG) != pid_) return std::nullopt;
  pid_ = -1;
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace upswing
