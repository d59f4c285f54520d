#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "base/error.h"
#include "os/file.h"
#include "os/making.h"

/// Locks of files and folders. They end with the object or the process. On a file system without
/// locks, all constructors throw NoLocks and leave nothing there.
namespace upswing {

/// Error: the file system of a path cannot lock it.
class NoLocks : public Error {
 public:
  NoLocks(const std::filesystem::path& path, int error_number);
};

/// Error: another process works in the folder.
class FolderBusy : public Error {
 public:
  explicit FolderBusy(const std::filesystem::path& folder);
};

/// Lock that keeps other processes from working in a folder while the object exists.
class FolderLock {
 public:
  /// Throws FolderBusy if another process holds the lock. Otherwise throws as PathError does.
  explicit FolderLock(const std::filesystem::path& folder);
  /// Keeps the lock of a folder under construction, also after Publish. Throws NoLocks.
  explicit FolderLock(const Making& folder);

 private:
  std::shared_ptr<const void> held_;  // of system::LockOpen
};

/// Opens or makes a file to append to, and locks it while it is open. Returns none if another
/// process holds the lock. Throws as AppendFile does, and NoLocks.
std::optional<AppendFile> OpenLocked(const std::filesystem::path& path);

/// Lock on a file, by which one process reserves a piece of work that processes on many hosts
/// share. The file contains the holder. On NFSv4 the lock ends some time after its host does. The
/// file of a killed process stays, but is not locked.
class FileLock {
 public:
  /// Makes the file if there is none, and locks it unless another process holds the lock. Throws as
  /// OpenLocked does.
  explicit FileLock(const std::filesystem::path& path);
  /// Removes the file, if this object holds the lock.
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

  /// Whether this object holds the lock.
  bool held() const { return file_.has_value(); }

  /// Whether a process holds the lock of a file; false if the system cannot tell.
  static bool IsHeld(const std::filesystem::path& path);
  /// Content of a file that process `pid` of this host has locked: host and process.
  static std::string Holder(int64_t pid);

 private:
  std::optional<AppendFile> file_;
};

/// Throws NoLocks if files in a folder cannot be locked. On NFS the folder itself may have a lock
/// nevertheless.
void ExpectFileLocks(const std::filesystem::path& folder);

}  // namespace upswing
