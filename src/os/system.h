#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>

#include "os/making.h"

/// System calls on files, which differ between systems: file_posix.cc and lock_posix.cc, or
/// file_windows.cc and lock_windows.cc. A failed call sets errno. Only src/os uses them.
namespace upswing::system {

enum class Access {
  kRead,       // never waits, also not for the writer of a pipe
  kAppend,     // does not follow a link; makes the file if there is none
  kAppendNew,  // fails with EEXIST if something is there
  kOverwrite,  // an existing pipe or device; ENXIO for a pipe without a reader
};

/// Opens a file. The descriptor is negative if that fails.
Descriptor Open(const std::filesystem::path& path, Access access);
/// Opens a folder, to lock it.
Descriptor OpenFolder(const std::filesystem::path& path);

/// Reads at most the size of `buffer`; 0 at the end of the file, negative on failure.
ptrdiff_t Read(int fd, std::span<std::byte> buffer);
/// Writes all bytes, in as many calls as necessary. Returns whether it could, as the next ones do.
bool WriteAll(int fd, std::span<const std::byte> bytes);
/// Waits until everything is on disk.
bool Sync(int fd);
/// Cuts a file to `size` bytes.
bool CutTo(int fd, int64_t size);

/// What a descriptor is open for.
struct OpenFile {
  enum class Kind { kFile, kFolder, kOther };
  Kind kind = Kind::kOther;
  int64_t size = 0;
  int64_t names = 1;  // hard links
};
std::optional<OpenFile> Describe(int fd);

/// Whether this user may write a file.
bool MayWrite(const std::filesystem::path& path);
/// Removes a file, also while it is open.
void Remove(const std::filesystem::path& path);
/// Whether the open file is the one at `path`.
bool IsAt(const std::filesystem::path& path, int fd);

/// Lock of an open file or folder, which follows it when it is renamed. It ends with the last copy
/// of the pointer and with `fd`. Returns null with EWOULDBLOCK if another holder has it.
std::shared_ptr<const void> LockOpen(int fd);
/// Whether an error number says that another process holds the lock.
bool IsOfHolder(int error_number);

/// Lock of a file's content, also between hosts. It ends when `fd` is closed.
bool LockContent(int fd);
/// Whether a process holds the lock of LockContent.
bool IsContentLocked(const std::filesystem::path& path);

}  // namespace upswing::system
