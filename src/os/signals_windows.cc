#include <io.h>

#include <array>
#include <atomic>
#include <csignal>
#include <thread>

#include "base/text.h"
#include "os/signals.h"
#include "os/win32.h"

namespace upswing {
namespace {

using win32::Handle;

std::atomic<int> g_stop_signal{0};
std::atomic<bool> g_checkpoint_wanted{false};
std::string_view g_notice;         // set before the handler is installed
void (*g_switch_off)() = nullptr;  // set before the handler is installed

// Signals between processes of ours; each is an event with the receiver's number in its name.
constexpr int kCheckpoint = 10;  // SIGUSR1 of Linux
constexpr std::array kSignals{SIGINT, SIGTERM, kCheckpoint};

std::wstring EventName(DWORD process, int signal) {
  return win32::Wide(Concat("Local\\upswing-", process, "-signal-", signal));
}

/// Receives the signals of other processes until this one ends.
void Listen(std::array<HANDLE, kSignals.size()> events) {
  while (true) {
    const DWORD got =
        WaitForMultipleObjects(static_cast<DWORD>(events.size()), events.data(), FALSE, INFINITE) -
        WAIT_OBJECT_0;
    if (got >= kSignals.size()) return;
    if (kSignals.at(got) == kCheckpoint) {
      g_checkpoint_wanted = true;
    } else {
      g_stop_signal = kSignals.at(got);
    }
  }
}

/// Records Ctrl-C, and a console that closes, in a thread of the system. The second one of a kind
/// switches the motors off and ends the program.
BOOL WINAPI Record(DWORD event) {
  const int signal = event == CTRL_C_EVENT ? SIGINT : SIGTERM;
  if (g_stop_signal.exchange(signal) == signal) {
    if (g_switch_off != nullptr) g_switch_off();
    return FALSE;  // ends the program
  }
  if (!g_notice.empty()) {
    (void)_write(2, g_notice.data(), static_cast<unsigned>(g_notice.size()));
  }
  // After this handler, the system ends the program; until then it may write a checkpoint.
  if (event != CTRL_C_EVENT && event != CTRL_BREAK_EVENT) Sleep(INFINITE);
  return TRUE;
}

}  // namespace

bool win32::SendSignal(DWORD process, int signal) {
  const Handle event(OpenEventW(EVENT_MODIFY_STATE, FALSE, EventName(process, signal).c_str()));
  return event.valid() && SetEvent(event.get()) != 0;
}

const int kCheckpointSignal = kCheckpoint;

void ListenToSignals() {
  std::array<HANDLE, kSignals.size()> events{};
  for (size_t i = 0; i < events.size(); ++i) {
    events.at(i) = CreateEventW(nullptr, FALSE, FALSE,
                                EventName(GetCurrentProcessId(), kSignals.at(i)).c_str());
  }
  std::thread(Listen, events).detach();
}

void InstallSignalHandlers(std::string_view notice) {
  g_notice = _isatty(2) != 0 ? notice : "";
  SetConsoleCtrlHandler(Record, TRUE);
}

void GuardMotors(void (*switch_off)()) {
  g_switch_off = switch_off;
  g_notice = "";
  SetConsoleCtrlHandler(Record, TRUE);
}

bool TakeCheckpointRequest() { return g_checkpoint_wanted.exchange(false); }

int StopSignal() { return g_stop_signal; }

}  // namespace upswing
