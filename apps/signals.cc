#include "apps/signals.h"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>

namespace upswing {
namespace {

std::atomic<int> g_stop_signal{0};
std::atomic<bool> g_checkpoint_wanted{false};
std::string_view g_notice;  // set before the handlers are installed
static_assert(std::atomic<int>::is_always_lock_free);

/// Records the first of these signals; a second one ends the program at once.
void StopAt(int number) {
  struct sigaction stop {};
  stop.sa_handler = [](int signal) {
    g_stop_signal = signal;
    if (g_notice.empty()) return;
    const int interrupted_errno = errno;
    (void)!write(STDERR_FILENO, g_notice.data(), g_notice.size());
    errno = interrupted_errno;
  };
  stop.sa_flags = SA_RESETHAND | SA_RESTART;
  sigaction(number, &stop, nullptr);
}

}  // namespace

void ListenToSignals() {
  struct sigaction checkpoint {};
  checkpoint.sa_handler = [](int) { g_checkpoint_wanted = true; };
  checkpoint.sa_flags = SA_RESTART;
  sigaction(SIGUSR1, &checkpoint, nullptr);
  std::signal(SIGUSR2, SIG_IGN);
}

void InstallSignalHandlers(std::string_view notice) {
  g_notice = isatty(STDERR_FILENO) == 1 ? notice : "";
  StopAt(SIGINT);
  StopAt(SIGTERM);
}

void StopAtUserSignals() {
  StopAt(SIGUSR1);
  StopAt(SIGUSR2);
}

TrainRequest PollSignals() {
  if (g_stop_signal != 0) return TrainRequest::kStop;
  if (g_checkpoint_wanted.exchange(false)) return TrainRequest::kCheckpoint;
  return TrainRequest::kGoOn;
}

int StopSignal() { return g_stop_signal; }

}  // namespace upswing
