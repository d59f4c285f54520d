#include <cerrno>

#include "base/text.h"
#include "os/system.h"
#include "os/win32.h"

namespace upswing::system {
namespace {

using win32::Handle;

// Locks of Windows keep others from reading the locked bytes. These lie far beyond any file's end.
constexpr DWORD kLockedHigh = 0x40000000;

OVERLAPPED LockedBytes() {
  OVERLAPPED bytes{};
  bytes.OffsetHigh = kLockedHigh;
  return bytes;
}

bool LockBytes(HANDLE handle) {
  OVERLAPPED bytes = LockedBytes();
  return LockFileEx(handle, LOCKFILE_EXCLUSIVE_LOCK | LOCKFILE_FAIL_IMMEDIATELY, 0, 1, 0, &bytes) !=
         0;
}

}  // namespace

std::shared_ptr<const void> LockOpen(int fd) {
  // Windows cannot lock a folder. An object whose name has the file's number stands for the lock:
  // it exists as long as a process has it open.
  BY_HANDLE_FILE_INFORMATION file{};
  if (GetFileInformationByHandle(win32::HandleOf(fd), &file) == 0) {
    (void)win32::Fail();
    return nullptr;
  }
  const std::string name = Concat("Global\\upswing-", file.dwVolumeSerialNumber, "-",
                                  file.nFileIndexHigh, "-", file.nFileIndexLow);
  Handle event(CreateEventW(nullptr, TRUE, FALSE, win32::Wide(name).c_str()));
  const DWORD error = GetLastError();
  // One that another user holds cannot be opened.
  if (error == ERROR_ALREADY_EXISTS || error == ERROR_ACCESS_DENIED) {
    errno = EWOULDBLOCK;
    return nullptr;
  }
  if (!event.valid()) {
    (void)win32::Fail();
    return nullptr;
  }
  return std::make_shared<Handle>(std::move(event));
}

bool IsOfHolder(int error_number) {
  return error_number == EAGAIN || error_number == EWOULDBLOCK || error_number == EACCES;
}

bool LockContent(int fd) { return LockBytes(win32::HandleOf(fd)) || win32::Fail(); }

bool IsContentLocked(const std::filesystem::path& path) {
  const Descriptor fd = Open(path, Access::kRead);
  const HANDLE handle = win32::HandleOf(fd.get());
  if (fd.get() < 0) return false;
  if (!LockBytes(handle)) {
    return GetLastError() == ERROR_LOCK_VIOLATION || GetLastError() == ERROR_IO_PENDING;
  }
  OVERLAPPED bytes = LockedBytes();
  UnlockFileEx(handle, 0, 1, 0, &bytes);
  return false;
}

}  // namespace upswing::system
