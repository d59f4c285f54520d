#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace upswing {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept;
  Descriptor& operator=(Descriptor&& other) noexcept;
  int get() const { return fd_; }

 private:
  int fd_;
};

/// 16 random hexadecimal digits, for a name that no other process takes.
std::string RandomDigits();

/// A file or folder that is being made. It appears under its name complete or not at all: until it
/// is complete it is called `.NAME.making-` and 16 hexadecimal digits, 8 of this host and 8 random,
/// in the same folder, and is locked. One of this host without a lock was left behind by a process
/// that was killed; the next Making in that folder removes it. One of another host, whose locks may
/// not be seen here, is removed an hour after its last change.
class Making {
 public:
  enum class Kind { kFile, kFolder };

  /// Makes it under the temporary name, empty, with a mode by the umask. Throws as PathError does.
  Making(const std::filesystem::path& path, Kind kind);
  /// Removes it unless it was published.
  ~Making();
  Making(const Making&) = delete;
  Making& operator=(const Making&) = delete;

  /// Of a file: open for writing.
  int descriptor() const { return descriptor_.get(); }
  /// The temporary path.
  const std::filesystem::path& path() const { return path_; }

  /// Gives it its final name. A file or link of that name is replaced, never followed; a folder
  /// also replaces an empty folder. Throws as PathError does.
  void Publish();

 private:
  void RemoveAbandoned() const;
  /// Makes and locks it under a random name; false if another name must be tried.
  bool TryOpen(Kind kind);

  std::filesystem::path target_;  // its final path
  Descriptor folder_;             // the folder that holds it
  std::string name_;
  std::filesystem::path path_;
  Descriptor descriptor_;
  bool published_ = false;
};

/// Removes a folder with its contents, in one step as others see it. Throws as PathError does.
void RemoveFolder(const std::filesystem::path& folder);

/// Whether this is the temporary name of a Making.
bool IsMakingName(std::string_view name);

}  // namespace upswing
