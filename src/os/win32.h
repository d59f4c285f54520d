#pragma once

// Parts of the Windows API for the files *_windows.cc.
#ifndef WIN32_LEAN_AND_MEAN
#define WIN32_LEAN_AND_MEAN
#endif
#ifndef NOMINMAX
#define NOMINMAX
#endif
// The second header needs the first.
// clang-format off
#include <windows.h>
#include <shellapi.h>
// clang-format on

#include <string>
#include <string_view>
#include <vector>

#include "os/making.h"

namespace upswing::win32 {

/// A handle of the system that closes itself; may be invalid.
class Handle {
 public:
  explicit Handle(HANDLE handle = nullptr) : handle_(handle) {}
  ~Handle() { Close(); }
  Handle(Handle&& other) noexcept : handle_(other.Release()) {}
  Handle& operator=(Handle&& other) noexcept;
  HANDLE get() const { return handle_; }
  bool valid() const { return handle_ != nullptr && handle_ != INVALID_HANDLE_VALUE; }
  void Close();
  HANDLE Release();

 private:
  HANDLE handle_;
};

/// The errno of GetLastError.
int LastErrno();
/// Sets errno to LastErrno and returns false.
bool Fail();

/// The handle of a descriptor.
HANDLE HandleOf(int fd);
/// A descriptor that owns the handle; on failure it is negative, with errno. `flags`: _O_APPEND
/// writes to the end of a file.
Descriptor DescriptorOf(Handle handle, int flags = 0);

/// Text as the system takes it. Our texts are UTF-8.
std::wstring Wide(std::string_view text);
std::string Narrow(std::wstring_view text);

/// A command line whose words a C program reads back (the rules of CommandLineToArgvW).
std::wstring CommandLineOf(const std::vector<std::string>& words);

/// A started program and its process group.
struct Process {
  Handle process = Handle();
  DWORD id = 0;
};
/// Starts a program with these standard files, which it inherits. Without `path`, the first word
/// is looked for in the PATH. The process is invalid on failure, with GetLastError.
Process Start(const std::vector<std::string>& words, const std::wstring& path, HANDLE input,
              HANDLE output, HANDLE error, DWORD flags);
/// Waits for the end of a process and returns its exit code.
int WaitFor(const Handle& process);

/// Sends a signal of os/signals.h to a process of ours. Returns whether it listens.
bool SendSignal(DWORD process, int signal);

}  // namespace upswing::win32
