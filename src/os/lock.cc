#include "os/lock.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include "base/text.h"
#include "os/host.h"
#include "os/system.h"

namespace upswing {

namespace fs = std::filesystem;

NoLocks::NoLocks(const fs::path& path, int error_number)
    : Error(2, Concat("cannot lock ", path.string(), ": ", std::strerror(error_number),
                      " (expected a file system with file locks)")) {}

FolderBusy::FolderBusy(const fs::path& folder)
    : Error(2, Concat(folder.string(), ": another process is at work here")) {}

FolderLock::FolderLock(const fs::path& folder) {
  const Descriptor open = system::OpenFolder(folder);
  if (open.get() < 0) throw PathError("cannot read", folder, errno);
  held_ = system::LockOpen(open.get());
  if (!held_ && system::IsOfHolder(errno)) throw FolderBusy(folder);
  if (!held_) throw NoLocks(folder, errno);
}

FolderLock::FolderLock(const Making& folder) : held_(folder.lock()) {
  if (!held_) held_ = system::LockOpen(folder.descriptor());
  if (!held_) throw NoLocks(folder.target(), errno);
}

std::optional<AppendFile> OpenLocked(const fs::path& path) {
  AppendFile file(path);
  if (!system::LockContent(file.descriptor())) {
    const int error_number = errno;
    if (system::IsOfHolder(error_number)) return std::nullopt;
    if (file.is_new()) system::Remove(path);
    throw NoLocks(path, error_number);
  }
  // Between opening and locking, the holder may have removed the file.
  if (!system::IsAt(path, file.descriptor())) return std::nullopt;
  return file;
}

FileLock::FileLock(const fs::path& path) {
  // The file of another user counts as locked.
  if (Exists(path) && !system::MayWrite(path) && errno == EACCES) return;
  std::optional<AppendFile> file = OpenLocked(path);
  if (!file) return;
  file->CutTo(0);
  file->Append(Holder(ProcessId()));
  file_ = std::move(file);
}

FileLock::~FileLock() {
  if (file_ && system::IsAt(file_->path(), file_->descriptor())) system::Remove(file_->path());
}

bool FileLock::IsHeld(const fs::path& path) { return system::IsContentLocked(path); }

std::string FileLock::Holder(int64_t pid) { return Concat(HostName(), " ", pid, "\n"); }

void ExpectFileLocks(const fs::path& folder) {
  const FileLock probe(folder / Concat(".locks-", ProcessId()));
}

}  // namespace upswing
