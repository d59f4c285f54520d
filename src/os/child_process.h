#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace upswing {

/// A second process of this program. It has no terminal: its input is empty, its output goes to the
/// end of a log, and the terminal's Ctrl-C does not reach it. The system kills it when this process
/// ends for any reason.
class ChildProcess {
 public:
  /// Starts the process with these arguments. Throws Failure. Call it only when no other threads
  /// run.
  ChildProcess(const std::vector<std::string>& arguments, const std::filesystem::path& log);
  /// Kills the process if it still runs.
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;

  /// Sends SIGINT, SIGTERM or kCheckpointSignal (os/signals.h).
  void Signal(int signal) const;
  /// Process ID; -1 once the process has ended.
  int64_t pid() const { return pid_; }

  /// Exit code of the process, or 128 plus the signal that ended it; nothing while it runs.
  std::optional<int> Poll();

 private:
  int64_t pid_ = -1;                      // -1 once it has ended
  std::shared_ptr<const void> handle_{};  // of the process, on Windows
};

}  // namespace upswing
