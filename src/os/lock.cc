#include "os/lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "base/text.h"
#include "os/host.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// A lock of a whole file. It is one of a byte range, which a process on the NFS server respects,
/// too. It is one of an open file: a second descriptor of this process does not get it.
struct flock WholeFile() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  return lock;
}

/// Whether the open file `fd` is the one at `path`.
bool IsAt(const fs::path& path, int fd) {
  struct stat at_path {};
  struct stat open {};
  return lstat(path.c_str(), &at_path) == 0 && fstat(fd, &open) == 0 &&
         at_path.st_dev == open.st_dev && at_path.st_ino == open.st_ino;
}

/// Whether an error of a system call says that another process holds the lock.
bool IsOfHolder(int error_number) { return error_number == EAGAIN || error_number == EACCES; }

}  // namespace

NoLocks::NoLocks(const fs::path& path, int error_number)
    : Error(2, Concat("cannot lock ", path.string(), ": ", std::strerror(error_number),
                      " (expected a file system with file locks)")) {}

FolderBusy::FolderBusy(const fs::path& folder)
    : Error(2, Concat(folder.string(), ": another process is at work here")) {}

FolderLock::FolderLock(const fs::path& folder)
    : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_.get() < 0) throw PathError("cannot read", folder, errno);
  Lock(folder);
}

// The lock is one of an open file, and both descriptors are of the same one.
FolderLock::FolderLock(const Making& folder)
    : descriptor_(fcntl(folder.descriptor(), F_DUPFD_CLOEXEC, 0)) {
  if (descriptor_.get() < 0) throw PathError("cannot lock", folder.target(), errno);
  Lock(folder.target());
}

void FolderLock::Lock(const fs::path& folder) const {
  if (flock(descriptor_.get(), LOCK_EX | LOCK_NB) == 0) return;
  if (IsOfHolder(errno)) throw FolderBusy(folder);
  throw NoLocks(folder, errno);
}

std::optional<AppendFile> OpenLocked(const fs::path& path) {
  AppendFile file(path);
  struct flock whole = WholeFile();
  if (fcntl(file.descriptor(), F_OFD_SETLK, &whole) != 0) {
    const int error_number = errno;
    if (IsOfHolder(error_number)) return std::nullopt;
    if (file.is_new()) unlink(path.c_str());
    throw NoLocks(path, error_number);
  }
  // Between opening and locking, the holder may have removed the file.
  if (!IsAt(path, file.descriptor())) return std::nullopt;
  return file;
}

FileLock::FileLock(const fs::path& path) {
  // The file of another user counts as locked.
  if (Exists(path) && access(path.c_str(), W_OK) != 0 && errno == EACCES) return;
  std::optional<AppendFile> file = OpenLocked(path);
  if (!file) return;
  file->CutTo(0);
  file->Append(Holder(getpid()));
  file_ = std::move(file);
}

FileLock::~FileLock() {
  if (file_ && IsAt(file_->path(), file_->descriptor())) unlink(file_->path().c_str());
}

bool FileLock::IsHeld(const fs::path& path) {
  const Descriptor fd(open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct flock whole = WholeFile();
  return fd.get() >= 0 && fcntl(fd.get(), F_OFD_GETLK, &whole) == 0 && whole.l_type != F_UNLCK;
}

std::string FileLock::Holder(int64_t pid) { return Concat(HostName(), " ", pid, "\n"); }

void ExpectFileLocks(const fs::path& folder) {
  const FileLock probe(folder / Concat(".locks-", getpid()));
}

}  // namespace upswing
