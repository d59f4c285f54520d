#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

#include "os/system.h"

namespace upswing::system {
namespace {

/// A lock of a whole file. It is one of a byte range, which a process on the NFS server respects,
/// too. It is one of an open file: a second descriptor of this process does not get it.
struct flock WholeFile() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  return lock;
}

}  // namespace

std::shared_ptr<const void> LockOpen(int fd) {
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) return nullptr;
  // The lock is one of an open file, and both descriptors are of the same one.
  const int copy = fcntl(fd, F_DUPFD_CLOEXEC, 0);
  return copy < 0 ? nullptr : std::make_shared<Descriptor>(copy);
}

bool IsOfHolder(int error_number) {
  return error_number == EAGAIN || error_number == EWOULDBLOCK || error_number == EACCES;
}

bool LockContent(int fd) {
  struct flock whole = WholeFile();
  return fcntl(fd, F_OFD_SETLK, &whole) == 0;
}

bool IsContentLocked(const std::filesystem::path& path) {
  const Descriptor fd(open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct flock whole = WholeFile();
  return fd.get() >= 0 && fcntl(fd.get(), F_OFD_GETLK, &whole) == 0 && whole.l_type != F_UNLCK;
}

}  // namespace upswing::system
