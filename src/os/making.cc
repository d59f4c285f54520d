#include "os/making.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <ctime>
#include <memory>
#include <random>
#include <utility>

#include "base/checksum.h"
#include "base/text.h"
#include "os/file.h"
#include "os/host.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMark = ".making-";
constexpr int kDigits = 16, kHostDigits = 8;
constexpr int kMostTries = 100;  // one try is enough unless another process interferes
// A file or folder of another host without a change for this long is abandoned. Its lock tells
// nothing: on NFS and others, only the own host knows a folder's lock.
constexpr int64_t kAbandonedAfter = 3600;  // s

/// Digits that identify this host in temporary names.
std::string HostDigits() {
  Checksum host;
  host.Update(BytesOf(HostAndBoot()));
  return host.Hex().substr(0, kHostDigits);
}

/// A temporary name for `name`.
std::string MakingName(std::string_view name) {
  const auto random = HexDigits(std::random_device()(), kDigits - kHostDigits);
  return Concat('.', name, kMark, HostDigits(), random);
}

/// Whether a temporary name belongs to this host.
bool IsOfThisHost(std::string_view name) {
  return name.substr(name.size() - kDigits, kHostDigits) == HostDigits();
}

/// Tries to lock an open file or folder; false if another process holds the lock.
bool Lock(const Descriptor& fd) { return flock(fd.get(), LOCK_EX | LOCK_NB) == 0; }

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

Descriptor::Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

bool IsMakingName(std::string_view name) {
  if (name.size() < 1 + kMark.size() + kDigits || name.front() != '.') return false;
  const std::string_view end = name.substr(name.size() - kMark.size() - kDigits);
  const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  return end.starts_with(kMark) && std::ranges::all_of(end.substr(kMark.size()), is_digit);
}

void RemoveFolder(const fs::path& folder) {
  // Rename the folder to a temporary name first, so that a later Making removes what a killed
  // process leaves. The lock keeps others from removing it meanwhile. If locking fails, the folder
  // is already locked, or this file system has no locks and others cannot lock and remove it
  // either.
  const Descriptor held(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  (void)Lock(held);
  const fs::path gone = folder.parent_path() / MakingName(folder.filename().string());
  if (rename(folder.c_str(), gone.c_str()) != 0) throw PathError("cannot remove", folder, errno);
  std::error_code error;
  fs::remove_all(gone, error);
  if (error) throw PathError("cannot remove", gone, error.value());
}

Making::Making(const fs::path& path, Kind kind)
    : target_(path),
      folder_(open(path.has_parent_path() ? path.parent_path().c_str() : ".",
                   O_PATH | O_DIRECTORY | O_CLOEXEC)),
      descriptor_(-1) {
  if (folder_.get() < 0) throw PathError("cannot write", target_, errno);
  RemoveAbandoned();
  for (int tries = 1; !TryOpen(kind); ++tries) {
    if (tries == kMostTries) throw PathError("cannot write", target_, EEXIST);
  }
}

bool Making::TryOpen(Kind kind) {
  descriptor_ = Descriptor(-1);
  constexpr size_t kLongest = 200;  // bytes of NAME, so that the rest fits into 255
  name_ = MakingName(target_.filename().string().substr(0, kLongest));
  path_ = target_.parent_path() / name_;
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
  const bool is_ours = Lock(descriptor_) || errno != EWOULDBLOCK;
  return is_ours && HasName(descriptor_);
}

Making::~Making() {
  if (published_) return;
  std::error_code error;
  fs::remove_all(path_, error);
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
    const bool abandoned =
        IsOfThisHost(entry->d_name) ? Lock(left) : SecondsSinceChange(left) > kAbandonedAfter;
    if (!abandoned) continue;
    std::error_code error;
    fs::remove_all(target_.parent_path() / entry->d_name, error);
  }
}

}  // namespace upswing
