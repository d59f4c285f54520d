#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace upswing {

/// This program, run once more beside this process. It has no terminal: nothing comes in, what it
/// prints goes to the end of a log, and the terminal's Ctrl-C does not reach it. It is killed when
/// this process ends, however that comes about.
class ChildProcess {
 public:
  /// Starts it with these arguments. Throws Failure. Only for a process without other threads.
  ChildProcess(const std::vector<std::string>& arguments, const std::filesystem::path& log);
  /// Kills it if it still runs.
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;

  void Signal(int signal) const;
  /// Its number; -1 once it has ended.
  pid_t pid() const { return pid_; }

  /// How it ended: the exit code, or 128 and the signal that ended it; nothing while it runs.
  std::optional<int> Poll();

 private:
  pid_t pid_;  // -1 once it has ended
};

}  // namespace upswing
