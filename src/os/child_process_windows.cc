#include <algorithm>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "os/child_process.h"
#include "os/command.h"
#include "os/file.h"
#include "os/win32.h"

namespace upswing {
namespace {

using win32::Handle;

/// A job whose processes the system ends together with this process.
HANDLE Job() {
  static const Handle job = [] {
    Handle made(CreateJobObjectW(nullptr, nullptr));
    JOBOBJECT_EXTENDED_LIMIT_INFORMATION limits{};
    limits.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE;
    SetInformationJobObject(made.get(), JobObjectExtendedLimitInformation, &limits, sizeof limits);
    return made;
  }();
  return job.get();
}

const Handle& Of(const std::shared_ptr<const void>& handle) {
  return *static_cast<const Handle*>(handle.get());
}

/// A copy of a file's handle that a started program inherits. Each write through it goes to the end
/// of the file, also if several programs have a copy.
Handle InheritedForAppending(HANDLE handle) {
  HANDLE copy = nullptr;
  DuplicateHandle(GetCurrentProcess(), handle, GetCurrentProcess(), &copy,
                  FILE_APPEND_DATA | SYNCHRONIZE, TRUE, 0);
  return Handle(copy);
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& arguments,
                           const std::filesystem::path& log) {
  std::vector<std::string> words{"upswing"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const AppendFile log_file(log);
  const Handle output = InheritedForAppending(win32::HandleOf(log_file.descriptor()));
  SECURITY_ATTRIBUTES inherited{sizeof(SECURITY_ATTRIBUTES), nullptr, TRUE};
  const Handle nothing(CreateFileW(L"NUL", GENERIC_READ, FILE_SHARE_READ | FILE_SHARE_WRITE,
                                   &inherited, OPEN_EXISTING, 0, nullptr));
  win32::Process child = win32::Start(words, ProgramPath().wstring(), nothing.get(), output.get(),
                                      output.get(), CREATE_NEW_PROCESS_GROUP | CREATE_NO_WINDOW);
  if (!child.process.valid()) {
    throw Failure(Concat("cannot start a process: error ", GetLastError(), " of Windows"));
  }
  AssignProcessToJobObject(Job(), child.process.get());
  pid_ = child.id;
  handle_ = std::make_shared<Handle>(std::move(child.process));
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), handle_(std::move(other.handle_)) {}

ChildProcess::~ChildProcess() {
  if (pid_ < 0) return;
  TerminateProcess(Of(handle_).get(), 1);
  (void)win32::WaitFor(Of(handle_));
}

void ChildProcess::Signal(int signal) const {
  if (pid_ < 0) return;
  // os/signals_windows.cc listens. A program that does not listen yet ends, as on other systems.
  if (!win32::SendSignal(static_cast<DWORD>(pid_), signal)) TerminateProcess(Of(handle_).get(), 1);
}

std::optional<int> ChildProcess::Poll() {
  if (pid_ < 0 || WaitForSingleObject(Of(handle_).get(), 0) != WAIT_OBJECT_0) return std::nullopt;
  pid_ = -1;
  return win32::WaitFor(Of(handle_));
}

}  // namespace upswing
