#include "core/file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

std::string SystemError(std::string_view what, const fs::path& path) {
  return Concat(what, " ", path.string(), ": ", std::strerror(errno));
}

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

/// Writes all bytes, however many calls it takes; false with errno on failure.
bool WriteAll(int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
  return true;
}

void WriteInPlace(const fs::path& path, std::span<const std::span<const std::byte>> parts) {
  const Descriptor fd(open(path.c_str(), O_WRONLY));
  if (fd.get() < 0) throw Failure(SystemError("cannot write", path));
  for (const auto part : parts) {
    if (!WriteAll(fd.get(), part)) throw Failure(SystemError("cannot write", path));
  }
}

/// Makes a rename in `folder` durable. Some file systems cannot; the rename is atomic all the same.
void SyncFolder(const fs::path& folder) {
  const Descriptor fd(open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY));
  if (fd.get() >= 0) fsync(fd.get());
}

}  // namespace

std::span<const std::byte> BytesOf(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

std::vector<std::byte> ReadFile(const fs::path& path) {
  const Descriptor fd(open(path.c_str(), O_RDONLY));
  struct stat info {};
  if (fd.get() < 0 || fstat(fd.get(), &info) != 0) throw BadInput(SystemError("cannot read", path));
  if (S_ISDIR(info.st_mode)) {
    throw BadInput(Concat("cannot read ", path.string(), ": expected a file, got a folder"));
  }
  // A pipe has no size, so read until the end instead of trusting one.
  std::vector<std::byte> bytes(static_cast<size_t>(info.st_size));
  size_t filled = 0;
  while (true) {
    if (filled == bytes.size()) bytes.resize(bytes.size() + 65536);
    const ssize_t got = read(fd.get(), bytes.data() + filled, bytes.size() - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw BadInput(SystemError("cannot read", path));
    if (got == 0) break;
    filled += static_cast<size_t>(got);
  }
  bytes.resize(filled);
  return bytes;
}

std::string ReadTextFile(const fs::path& path) {
  const std::vector<std::byte> bytes = ReadFile(path);
  std::string text(bytes.size(), '\0');
  if (!bytes.empty()) std::memcpy(text.data(), bytes.data(), bytes.size());
  return text;
}

std::string ReadSmallTextFile(const fs::path& path, size_t most_bytes) {
  // Opening a pipe that nobody writes to would wait for somebody who does.
  const Descriptor fd(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  struct stat info {};
  if (fd.get() < 0 || fstat(fd.get(), &info) != 0) throw BadInput(SystemError("cannot read", path));
  const auto expect = [&](bool valid, std::string_view expected, const auto& got) {
    if (valid) return;
    throw BadInput(Concat("cannot read ", path.string(), ": expected ", expected, ", got ", got));
  };
  expect(S_ISREG(info.st_mode), "a file",
         S_ISDIR(info.st_mode) ? "a folder" : "a pipe or a device");
  const auto size = static_cast<size_t>(info.st_size);
  expect(size <= most_bytes, Concat("at most ", most_bytes, " bytes"), size);
  std::string text(size, '\0');
  size_t filled = 0;
  while (filled < size) {
    const ssize_t got = read(fd.get(), text.data() + filled, size - filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw BadInput(SystemError("cannot read", path));
    if (got == 0) break;  // it has become shorter meanwhile
    filled += static_cast<size_t>(got);
  }
  text.resize(filled);
  return text;
}

void WriteFileAtomically(const fs::path& given, std::span<const std::span<const std::byte>> parts) {
  // The file that a link leads to is what shall change, not the link.
  std::error_code error;
  const fs::path path = fs::exists(given, error) ? fs::canonical(given, error) : given;
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) {
    return WriteInPlace(path, parts);  // a pipe or a device cannot be replaced
  }

  const fs::path temporary =
      path.parent_path() / Concat(".", path.filename().string(), ".upswing-tmp");
  try {
    const Descriptor fd(open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666));
    if (fd.get() < 0) throw Failure(SystemError("cannot write", path));
    for (const auto part : parts) {
      if (!WriteAll(fd.get(), part)) throw Failure(SystemError("cannot write", path));
    }
    if (fsync(fd.get()) != 0) throw Failure(SystemError("cannot write", path));
    if (rename(temporary.c_str(), path.c_str()) != 0) {
      throw Failure(SystemError("cannot write", path));
    }
  } catch (...) {
    unlink(temporary.c_str());
    throw;
  }
  SyncFolder(path.parent_path());
}

void WriteFileAtomically(const fs::path& path, std::string_view text) {
  WriteFileAtomically(path, std::array{BytesOf(text)});
}

void CheckFree(const fs::path& folder, std::string_view advice) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(folder, error))) return;
  const bool is_folder = fs::is_directory(folder, error);
  if (is_folder && fs::is_empty(folder, error)) return;
  throw BadInput(Concat(folder.string(), ": expected a new or empty folder, got ",
                        is_folder ? "one that holds something" : "a file", " (", advice, ")"));
}

void MakeNewFolder(const fs::path& folder) {
  CheckFree(folder);
  MakeFolder(folder);
}

void MakeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw Failure(Concat("cannot make the folder ", folder.string(), ": ", error.message()));
  }
}

FolderLock::FolderLock(const fs::path& folder)
    : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0) throw BadInput(SystemError("cannot read", folder));
  if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    const bool taken = errno == EWOULDBLOCK;
    const std::string message = taken ? Concat(folder.string(), ": another process is at work here")
                                      : SystemError("cannot lock", folder);
    close(descriptor_);
    throw BadInput(message);
  }
}

FolderLock::~FolderLock() { close(descriptor_); }

AppendFile::AppendFile(fs::path path, int64_t size)
    : path_(std::move(path)),
      descriptor_(open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0666)),
      size_(size) {
  if (descriptor_ < 0) throw Failure(SystemError("cannot write", path_));
  struct stat info {};
  std::string problem;
  if (fstat(descriptor_, &info) != 0) {
    problem = SystemError("cannot read", path_);
  } else if (size == kKeepAll) {
    size_ = info.st_size;
  } else if (info.st_size < size) {
    problem = Concat(path_.string(), ": expected at least the ", size,
                     " bytes that the checkpoint knows of, got ", info.st_size);
  } else if (ftruncate(descriptor_, size) != 0) {
    problem = SystemError("cannot write", path_);
  }
  if (!problem.empty()) {
    close(descriptor_);
    throw Failure(problem);
  }
}

AppendFile::~AppendFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

AppendFile::AppendFile(AppendFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(other.size_) {}

void AppendFile::Sync() const {
  if (fsync(descriptor_) != 0) throw Failure(SystemError("cannot write", path_));
}

void AppendFile::Append(std::span<const std::byte> bytes) {
  if (!WriteAll(descriptor_, bytes)) throw Failure(SystemError("cannot write", path_));
  size_ += static_cast<int64_t>(bytes.size());
}

}  // namespace upswing
