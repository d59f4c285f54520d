#include <fcntl.h>
#include <io.h>

#include <algorithm>
#include <cerrno>

#include "os/system.h"
#include "os/win32.h"

namespace upswing::system {
namespace {

namespace fs = std::filesystem;
using win32::Handle;

// Other processes may read, write, rename and remove an open file, as elsewhere.
constexpr DWORD kShared = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;

Handle OpenHandle(const fs::path& path, DWORD access, DWORD creation, DWORD flags) {
  return Handle(CreateFileW(path.c_str(), access, kShared, nullptr, creation, flags, nullptr));
}

/// What the system knows of an open file: among it a number that no other file has.
std::optional<BY_HANDLE_FILE_INFORMATION> InformationOf(HANDLE handle) {
  BY_HANDLE_FILE_INFORMATION information{};
  if (GetFileInformationByHandle(handle, &information) == 0) return std::nullopt;
  return information;
}

}  // namespace

Descriptor Open(const fs::path& path, Access access) {
  // FILE_FLAG_BACKUP_SEMANTICS opens folders, too, so that the caller can name them.
  DWORD wanted = GENERIC_READ, creation = OPEN_EXISTING, flags = FILE_FLAG_BACKUP_SEMANTICS;
  if (access == Access::kOverwrite) wanted = GENERIC_WRITE;
  if (access == Access::kAppend || access == Access::kAppendNew) {
    wanted = GENERIC_WRITE | FILE_READ_ATTRIBUTES;
    creation = access == Access::kAppend ? OPEN_ALWAYS : CREATE_NEW;
    flags = FILE_FLAG_OPEN_REPARSE_POINT;
  }
  Handle handle = OpenHandle(path, wanted, creation, flags);
  const bool appends = (flags & FILE_FLAG_OPEN_REPARSE_POINT) != 0;
  if (appends && handle.valid()) {
    const auto information = InformationOf(handle.get());
    if (information && (information->dwFileAttributes & FILE_ATTRIBUTE_REPARSE_POINT) != 0) {
      errno = ELOOP;
      return Descriptor(-1);
    }
  }
  if (!handle.valid() && GetLastError() == ERROR_ACCESS_DENIED && access == Access::kAppend &&
      fs::is_directory(path)) {
    errno = EISDIR;
    return Descriptor(-1);
  }
  return win32::DescriptorOf(std::move(handle), appends ? _O_APPEND : 0);
}

Descriptor OpenFolder(const fs::path& path) {
  Handle handle = OpenHandle(path, FILE_READ_ATTRIBUTES, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS);
  const auto information = InformationOf(handle.get());
  if (information && (information->dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) == 0) {
    errno = ENOTDIR;
    return Descriptor(-1);
  }
  return win32::DescriptorOf(std::move(handle));
}

ptrdiff_t Read(int fd, std::span<std::byte> buffer) {
  constexpr size_t kMost = 1 << 30;
  return _read(fd, buffer.data(), static_cast<unsigned>(std::min(buffer.size(), kMost)));
}

bool WriteAll(int fd, std::span<const std::byte> bytes) {
  constexpr size_t kMost = 1 << 30;
  while (!bytes.empty()) {
    const int written =
        _write(fd, bytes.data(), static_cast<unsigned>(std::min(bytes.size(), kMost)));
    if (written <= 0) return false;
    bytes = bytes.subspan(written);
  }
  return true;
}

bool Sync(int fd) { return FlushFileBuffers(win32::HandleOf(fd)) != 0 || win32::Fail(); }

bool CutTo(int fd, int64_t size) {
  LARGE_INTEGER end{};
  end.QuadPart = size;
  const HANDLE handle = win32::HandleOf(fd);
  return (SetFilePointerEx(handle, end, nullptr, FILE_BEGIN) != 0 && SetEndOfFile(handle) != 0) ||
         win32::Fail();
}

std::optional<OpenFile> Describe(int fd) {
  const HANDLE handle = win32::HandleOf(fd);
  if (GetFileType(handle) != FILE_TYPE_DISK) return OpenFile{};
  const auto information = InformationOf(handle);
  if (!information) {
    (void)win32::Fail();
    return std::nullopt;
  }
  const bool is_folder = (information->dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0;
  return OpenFile{is_folder ? OpenFile::Kind::kFolder : OpenFile::Kind::kFile,
                  static_cast<int64_t>(information->nFileSizeHigh) << 32 |
                      static_cast<int64_t>(information->nFileSizeLow),
                  static_cast<int64_t>(information->nNumberOfLinks)};
}

bool MayWrite(const fs::path& path) {
  const Handle handle = OpenHandle(path, GENERIC_WRITE, OPEN_EXISTING, 0);
  return handle.valid() || win32::Fail();
}

void Remove(const fs::path& path) { DeleteFileW(path.c_str()); }

bool IsAt(const fs::path& path, int fd) {
  const Handle handle = OpenHandle(path, FILE_READ_ATTRIBUTES, OPEN_EXISTING,
                                   FILE_FLAG_BACKUP_SEMANTICS | FILE_FLAG_OPEN_REPARSE_POINT);
  const auto at_path = InformationOf(handle.get());
  const auto open = InformationOf(win32::HandleOf(fd));
  return at_path && open && at_path->dwVolumeSerialNumber == open->dwVolumeSerialNumber &&
         at_path->nFileIndexHigh == open->nFileIndexHigh &&
         at_path->nFileIndexLow == open->nFileIndexLow;
}

}  // namespace upswing::system
