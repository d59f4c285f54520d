#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "os/system.h"

namespace upswing::system {
namespace {

namespace fs = std::filesystem;

int FlagsOf(Access access) {
  constexpr int kAppend = O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW;
  switch (access) {
    case Access::kRead:
      return O_RDONLY;
    case Access::kAppend:
      return kAppend;
    case Access::kAppendNew:
      return kAppend | O_EXCL;
    case Access::kOverwrite:
      return O_WRONLY;
  }
  return O_RDONLY;
}

}  // namespace

Descriptor Open(const fs::path& path, Access access) {
  // Without O_NONBLOCK, opening a pipe would wait for its other end.
  Descriptor fd(open(path.c_str(), FlagsOf(access) | O_NONBLOCK | O_CLOEXEC, 0666));
  if (access == Access::kOverwrite && fd.get() >= 0) fcntl(fd.get(), F_SETFL, O_WRONLY);
  return fd;
}

Descriptor OpenFolder(const fs::path& path) {
  return Descriptor(open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
}

ptrdiff_t Read(int fd, std::span<std::byte> buffer) {
  while (true) {
    const ssize_t got = read(fd, buffer.data(), buffer.size());
    if (got >= 0 || errno != EINTR) return got;
  }
}

bool WriteAll(int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
  return true;
}

bool Sync(int fd) { return fsync(fd) == 0; }

bool CutTo(int fd, int64_t size) { return ftruncate(fd, size) == 0; }

std::optional<OpenFile> Describe(int fd) {
  struct stat info {};
  if (fstat(fd, &info) != 0) return std::nullopt;
  OpenFile file{OpenFile::Kind::kOther, info.st_size, static_cast<int64_t>(info.st_nlink)};
  if (S_ISREG(info.st_mode)) file.kind = OpenFile::Kind::kFile;
  if (S_ISDIR(info.st_mode)) file.kind = OpenFile::Kind::kFolder;
  return file;
}

bool MayWrite(const fs::path& path) { return access(path.c_str(), W_OK) == 0; }

void Remove(const fs::path& path) { unlink(path.c_str()); }

bool IsAt(const fs::path& path, int fd) {
  struct stat at_path {};
  struct stat open {};
  return lstat(path.c_str(), &at_path) == 0 && fstat(fd, &open) == 0 &&
         at_path.st_dev == open.st_dev && at_path.st_ino == open.st_ino;
}

}  // namespace upswing::system
