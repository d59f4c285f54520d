#include <io.h>

#include <cerrno>
#include <chrono>

#include "os/file.h"
#include "os/making.h"
#include "os/making_name.h"
#include "os/system.h"
#include "os/win32.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using win32::Handle;

constexpr DWORD kShared = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;

/// Renames a file or folder, over a file, and writes the new name to disk. A virus scanner may hold
/// a new file for a moment, so it tries again for a second.
bool Rename(const fs::path& from, const fs::path& to) {
  constexpr DWORD kPause = 20, kTries = 50;  // ms
  for (DWORD tries = 0; tries < kTries; ++tries) {
    if (MoveFileExW(from.c_str(), to.c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH)) {
      return true;
    }
    const DWORD error = GetLastError();
    // Only a file can be replaced; an empty folder makes way.
    if (fs::is_directory(from) && RemoveDirectoryW(to.c_str()) != 0) continue;
    SetLastError(error);
    if (error != ERROR_ACCESS_DENIED && error != ERROR_SHARING_VIOLATION) break;
    if (fs::is_directory(to)) break;
    Sleep(kPause);
    SetLastError(error);
  }
  return win32::Fail();
}

/// Seconds since the last change, by this machine's clock, which may be off by some minutes.
int64_t SecondsSinceChange(const fs::path& path) {
  std::error_code error;
  const auto changed = fs::last_write_time(path, error);
  if (error) return 0;
  return std::chrono::duration_cast<std::chrono::seconds>(fs::file_time_type::clock::now() -
                                                          changed)
      .count();
}

/// Opens a file or folder that exists, with rights that no other process can withhold.
Descriptor OpenAny(const fs::path& path) {
  return win32::DescriptorOf(
      Handle(CreateFileW(path.c_str(), FILE_READ_ATTRIBUTES, kShared, nullptr, OPEN_EXISTING,
                         FILE_FLAG_BACKUP_SEMANTICS | FILE_FLAG_OPEN_REPARSE_POINT, nullptr)));
}

fs::path ParentOf(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

}  // namespace

Descriptor::~Descriptor() {
  if (fd_ >= 0) _close(fd_);
}

void RemoveFolder(const fs::path& folder) {
  // Rename the folder to a temporary name first, so that a later Making removes what a killed
  // process leaves. The lock keeps others from removing it meanwhile.
  Descriptor open = system::OpenFolder(folder);
  const auto held = system::LockOpen(open.get());
  open = Descriptor(-1);
  const fs::path gone = folder.parent_path() / MakingName(folder.filename().string());
  if (!Rename(folder, gone)) throw PathError("cannot remove", folder, errno);
  std::error_code error;
  fs::remove_all(gone, error);
  if (error) throw PathError("cannot remove", gone, error.value());
}

Descriptor Making::OpenParent() const { return system::OpenFolder(ParentOf(target_)); }

bool Making::TryOpen(Kind kind) {
  descriptor_ = Descriptor(-1);
  if (kind == Kind::kFile) {
    descriptor_ = win32::DescriptorOf(Handle(
        CreateFileW(path_.c_str(), GENERIC_WRITE, kShared, nullptr, CREATE_NEW, 0, nullptr)));
  } else if (CreateDirectoryW(path_.c_str(), nullptr) != 0) {
    descriptor_ = OpenAny(path_);
    // Another process removed the folder before it was locked.
    if (descriptor_.get() < 0 && errno == ENOENT) return false;
  } else {
    (void)win32::Fail();
  }
  if (descriptor_.get() < 0) {
    if (errno == EEXIST) return false;
    throw PathError("cannot write", target_, errno);
  }
  // On a file system without locks, other processes remove nothing either.
  lock_ = system::LockOpen(descriptor_.get());
  const bool is_ours = lock_ || errno != EWOULDBLOCK;
  return is_ours && system::IsAt(path_, descriptor_.get());
}

void Making::Publish() {
  descriptor_ = Descriptor(-1);  // the lock stays
  if (!Rename(path_, target_)) throw PathError("cannot write", target_, errno);
  published_ = true;
}

void Making::RemoveAbandoned() const {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(ParentOf(target_), error)) {
    const std::string name = entry.path().filename().string();
    if (!IsMakingName(name)) continue;
    Descriptor left = OpenAny(entry.path());
    if (left.get() < 0) continue;
    // The lock is held while the file or folder is removed.
    const auto lock = system::LockOpen(left.get());
    const bool abandoned =
        IsOfThisHost(name) ? lock != nullptr : SecondsSinceChange(entry.path()) > kAbandonedAfter;
    left = Descriptor(-1);
    std::error_code ignored;
    if (abandoned) fs::remove_all(entry.path(), ignored);
  }
}

}  // namespace upswing
