#include "os/win32.h"

#include <fcntl.h>
#include <io.h>

#include <array>
#include <cerrno>
#include <utility>

namespace upswing::win32 {
namespace {

struct ErrorNumber {
  DWORD windows;
  int posix;
};
constexpr std::array kErrorNumbers{ErrorNumber{ERROR_FILE_NOT_FOUND, ENOENT},
                                   ErrorNumber{ERROR_PATH_NOT_FOUND, ENOENT},
                                   ErrorNumber{ERROR_INVALID_NAME, ENOENT},
                                   ErrorNumber{ERROR_BAD_NETPATH, ENOENT},
                                   ErrorNumber{ERROR_BAD_PATHNAME, ENOENT},
                                   ErrorNumber{ERROR_INVALID_DRIVE, ENOENT},
                                   ErrorNumber{ERROR_ACCESS_DENIED, EACCES},
                                   ErrorNumber{ERROR_SHARING_VIOLATION, EACCES},
                                   ErrorNumber{ERROR_LOCK_VIOLATION, EAGAIN},
                                   ErrorNumber{ERROR_IO_PENDING, EAGAIN},
                                   ErrorNumber{ERROR_FILE_EXISTS, EEXIST},
                                   ErrorNumber{ERROR_ALREADY_EXISTS, EEXIST},
                                   ErrorNumber{ERROR_DIR_NOT_EMPTY, ENOTEMPTY},
                                   ErrorNumber{ERROR_DIRECTORY, ENOTDIR},
                                   ErrorNumber{ERROR_DISK_FULL, ENOSPC},
                                   ErrorNumber{ERROR_WRITE_PROTECT, EROFS},
                                   ErrorNumber{ERROR_NOT_SUPPORTED, ENOSYS},
                                   ErrorNumber{ERROR_INVALID_FUNCTION, ENOSYS},
                                   ErrorNumber{ERROR_NOT_SAME_DEVICE, EXDEV},
                                   ErrorNumber{ERROR_FILENAME_EXCED_RANGE, ENAMETOOLONG},
                                   ErrorNumber{ERROR_BROKEN_PIPE, EPIPE},
                                   ErrorNumber{ERROR_NO_DATA, EPIPE},
                                   ErrorNumber{ERROR_NOT_ENOUGH_MEMORY, ENOMEM},
                                   ErrorNumber{ERROR_OUTOFMEMORY, ENOMEM},
                                   ErrorNumber{ERROR_TOO_MANY_OPEN_FILES, EMFILE},
                                   ErrorNumber{ERROR_INVALID_PARAMETER, EINVAL}};

/// Appends a word in quotes. Backslashes are plain characters except before a quote.
void AppendWord(std::string_view word, std::string& line) {
  if (!line.empty()) line += ' ';
  line += '"';
  size_t backslashes = 0;
  for (const char c : word) {
    if (c == '"') line.append(backslashes + 1, '\\');
    backslashes = c == '\\' ? backslashes + 1 : 0;
    line += c;
  }
  line.append(backslashes, '\\');
  line += '"';
}

}  // namespace

Handle& Handle::operator=(Handle&& other) noexcept {
  std::swap(handle_, other.handle_);
  return *this;
}

void Handle::Close() {
  if (valid()) CloseHandle(handle_);
  handle_ = nullptr;
}

HANDLE Handle::Release() { return std::exchange(handle_, nullptr); }

int LastErrno() {
  const DWORD last = GetLastError();
  for (const ErrorNumber& number : kErrorNumbers) {
    if (number.windows == last) return number.posix;
  }
  return EIO;
}

bool Fail() {
  errno = LastErrno();
  return false;
}

HANDLE HandleOf(int fd) {
  // NOLINTNEXTLINE(performance-no-int-to-ptr): the C library hands it over as a number
  return fd < 0 ? INVALID_HANDLE_VALUE : reinterpret_cast<HANDLE>(_get_osfhandle(fd));
}

Descriptor DescriptorOf(Handle handle, int flags) {
  if (!handle.valid()) {
    (void)Fail();
    return Descriptor(-1);
  }
  const int fd = _open_osfhandle(reinterpret_cast<intptr_t>(handle.get()), flags | _O_BINARY);
  if (fd >= 0) (void)handle.Release();
  return Descriptor(fd);
}

std::wstring Wide(std::string_view text) {
  const int size = static_cast<int>(text.size());
  std::wstring wide(MultiByteToWideChar(CP_UTF8, 0, text.data(), size, nullptr, 0), L'\0');
  MultiByteToWideChar(CP_UTF8, 0, text.data(), size, wide.data(), static_cast<int>(wide.size()));
  return wide;
}

std::string Narrow(std::wstring_view text) {
  const int size = static_cast<int>(text.size());
  std::string narrow(
      WideCharToMultiByte(CP_UTF8, 0, text.data(), size, nullptr, 0, nullptr, nullptr), '\0');
  WideCharToMultiByte(CP_UTF8, 0, text.data(), size, narrow.data(), static_cast<int>(narrow.size()),
                      nullptr, nullptr);
  return narrow;
}

std::wstring CommandLineOf(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) AppendWord(word, line);
  return Wide(line);
}

/// The program of this name in the folders of PATH; empty if there is none. CreateProcessW would
/// also take one from the current folder.
std::wstring FindInPath(const std::string& name) {
  const wchar_t* folders = _wgetenv(L"PATH");
  std::wstring found(32768, L'\0');  // the longest path
  const DWORD size = folders == nullptr
                         ? 0
                         : SearchPathW(folders, Wide(name).c_str(), L".exe",
                                       static_cast<DWORD>(found.size()), found.data(), nullptr);
  found.resize(size < found.size() ? size : 0);
  return found;
}

Process Start(const std::vector<std::string>& words, const std::wstring& path, HANDLE input,
              HANDLE output, HANDLE error, DWORD flags) {
  STARTUPINFOW startup{};
  startup.cb = sizeof startup;
  startup.dwFlags = STARTF_USESTDHANDLES;
  startup.hStdInput = input;
  startup.hStdOutput = output;
  startup.hStdError = error;
  PROCESS_INFORMATION information{};
  std::wstring line = CommandLineOf(words);
  const std::wstring program = path.empty() ? FindInPath(words.front()) : path;
  if (program.empty()) {
    SetLastError(ERROR_FILE_NOT_FOUND);
    return Process{};
  }
  if (CreateProcessW(program.c_str(), line.data(), nullptr, nullptr, TRUE, flags, nullptr, nullptr,
                     &startup, &information) == 0) {
    return Process{};
  }
  const Handle thread(information.hThread);
  return Process{Handle(information.hProcess), information.dwProcessId};
}

int WaitFor(const Handle& process) {
  WaitForSingleObject(process.get(), INFINITE);
  DWORD code = 1;
  GetExitCodeProcess(process.get(), &code);
  return static_cast<int>(code);
}

}  // namespace upswing::win32
