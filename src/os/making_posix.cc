#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <ctime>
#include <memory>

#include "os/file.h"
#include "os/making.h"
#include "os/making_name.h"
#include "os/system.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Seconds since the last change, by this machine's clock, which may be off by some minutes.
int64_t SecondsSinceChange(const Descriptor& fd) {
  struct stat info {};
  if (fstat(fd.get(), &info) != 0) return 0;
  return std::time(nullptr) - info.st_mtime;
}

/// Whether an open file or folder still has a name.
bool HasName(const Descriptor& fd) {
  struct stat info {};
  return fstat(fd.get(), &info) == 0 && info.st_nlink > 0;
}

}  // namespace

Descriptor::~Descriptor() {
  if (fd_ >= 0) close(fd_);
}

void RemoveFolder(const fs::path& folder) {
  // Rename the folder to a temporary name first, so that a later Making removes what a killed
  // process leaves. The lock keeps others from removing it meanwhile. If locking fails, the folder
  // is already locked, or this file system has no locks and others cannot lock and remove it
  // either.
  const Descriptor open = system::OpenFolder(folder);
  const auto held = system::LockOpen(open.get());
  const fs::path gone = folder.parent_path() / MakingName(folder.filename().string());
  if (rename(folder.c_str(), gone.c_str()) != 0) throw PathError("cannot remove", folder, errno);
  std::error_code error;
  fs::remove_all(gone, error);
  if (error) throw PathError("cannot remove", gone, error.value());
}

Descriptor Making::OpenParent() const {
  return Descriptor(open(target_.has_parent_path() ? target_.parent_path().c_str() : ".",
                         O_PATH | O_DIRECTORY | O_CLOEXEC));
}

bool Making::TryOpen(Kind kind) {
  descriptor_ = Descriptor(-1);
  constexpr int kCommon = O_NOFOLLOW | O_CLOEXEC;
  if (kind == Kind::kFile) {
    descriptor_ = Descriptor(
        openat(folder_.get(), name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | kCommon, 0666));
  } else if (mkdirat(folder_.get(), name_.c_str(), 0777) == 0) {
    descriptor_ =
        Descriptor(openat(folder_.get(), name_.c_str(), O_RDONLY | O_DIRECTORY | kCommon));
    // Another process removed the folder before it was locked.
    if (descriptor_.get() < 0 && errno == ENOENT) return false;
  }
  if (descriptor_.get() < 0) {
    if (errno == EEXIST) return false;
    throw PathError("cannot write", target_, errno);
  }
  // On a file system without locks, other processes remove nothing either.
  lock_ = system::LockOpen(descriptor_.get());
  const bool is_ours = lock_ || errno != EWOULDBLOCK;
  return is_ours && HasName(descriptor_);
}

void Making::Publish() {
  const std::string name = target_.filename();
  if (renameat(folder_.get(), name_.c_str(), folder_.get(), name.c_str()) != 0) {
    throw PathError("cannot write", target_, errno);
  }
  published_ = true;
  // Synchronise the new name to disk. Some file systems cannot, but the change is atomic anyway.
  const Descriptor folder(openat(folder_.get(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.get() >= 0) fsync(folder.get());
}

void Making::RemoveAbandoned() const {
  const int fd = openat(folder_.get(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;  // the folder is writable but not readable
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(fdopendir(fd), &closedir);
  if (!entries) {
    close(fd);
    return;
  }
  while (const dirent* entry = readdir(entries.get())) {
    if (!IsMakingName(entry->d_name)) continue;
    const Descriptor left(
        openat(folder_.get(), entry->d_name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (left.get() < 0) continue;
    // The lock is held while the file or folder is removed.
    const auto lock = system::LockOpen(left.get());
    const bool abandoned =
        IsOfThisHost(entry->d_name) ? lock != nullptr : SecondsSinceChange(left) > kAbandonedAfter;
    if (!abandoned) continue;
    std::error_code error;
    fs::remove_all(target_.parent_path() / entry->d_name, error);
  }
}

}  // namespace upswing
