#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>

#include "os/signals.h"

namespace upswing {
namespace {

std::atomic<int> g_stop_signal{0};
std::atomic<bool> g_checkpoint_wanted{false};
std::string_view g_notice;         // set before the handlers are installed
void (*g_switch_off)() = nullptr;  // set before the handlers are installed
static_assert(std::atomic<int>::is_always_lock_free);

void Handle(int number, void (*handler)(int), int flags) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  sigaction(number, &action, nullptr);
}

void Record(int signal) {
  g_stop_signal = signal;
  if (g_notice.empty()) return;
  const int interrupted_errno = errno;
  (void)!write(STDERR_FILENO, g_notice.data(), g_notice.size());
  errno = interrupted_errno;
}

/// Switches the motors off and ends the program. SA_RESETHAND has restored the signal's default.
void EndNow(int signal) {
  g_switch_off();
  raise(signal);
}

/// Records the first of these signals. A second one switches the motors off and ends the program.
void BrakeOrEnd(int signal) {
  g_stop_signal = signal;
  Handle(signal, EndNow, SA_RESETHAND);
}

}  // namespace

const int kCheckpointSignal = SIGUSR1;

void ListenToSignals() {
  Handle(
      SIGUSR1, [](int) { g_checkpoint_wanted = true; }, SA_RESTART);
  std::signal(SIGUSR2, SIG_IGN);
}

void InstallSignalHandlers(std::string_view notice) {
  g_notice = isatty(STDERR_FILENO) == 1 ? notice : "";
  for (const int number : {SIGINT, SIGTERM}) Handle(number, Record, SA_RESETHAND | SA_RESTART);
}

void GuardMotors(void (*switch_off)()) {
  g_switch_off = switch_off;
  g_notice = "";  // a terminal that is stopped by Ctrl-S would stop the handler, too
  for (const int number : {SIGINT, SIGTERM, SIGQUIT}) Handle(number, BrakeOrEnd, SA_RESTART);
  // A terminal that closes sends SIGHUP twice.
  for (const int number : {SIGHUP, SIGTSTP, SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM, SIGPROF, SIGPOLL,
                           SIGPWR, SIGSTKFLT, SIGXCPU}) {
    Handle(number, Record, SA_RESTART);
  }
  for (int number = SIGRTMIN; number <= SIGRTMAX; ++number) Handle(number, Record, SA_RESTART);
  std::signal(SIGTTIN, SIG_IGN);
  std::signal(SIGTTOU, SIG_IGN);
  // A handler of its own stack works when the program's stack has overflowed.
  static std::array<char, 1 << 16> stack;
  const stack_t other{stack.data(), 0, stack.size()};
  sigaltstack(&other, nullptr);
  for (const int number : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS}) {
    Handle(number, EndNow, SA_RESETHAND | SA_NODEFER | SA_ONSTACK);
  }
}

bool TakeCheckpointRequest() { return g_checkpoint_wanted.exchange(false); }

int StopSignal() { return g_stop_signal; }

}  // namespace upswing
