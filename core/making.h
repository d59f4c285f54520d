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

/// A file or folder that is being made. It appears under its name whole or not at all: until it is
/// done it is called `.NAME.making-` and 16 hexadecimal digits that nobody can foresee, in the same
/// folder, and carries a lock. One without a lock was left behind by a process that was killed;
/// whoever makes something in that folder next removes it.
class Making {
 public:
  enum class Kind { kFile, kFolder };

  /// Begins it, empty; the mode follows the umask. Throws as PathError does.
  Making(const std::filesystem::path& path, Kind kind);
  /// Removes what was not published.
  ~Making();
  Making(const Making&) = delete;
  Making& operator=(const Making&) = delete;

  /// Open for writing if it is a file.
  int descriptor() const { return descriptor_.get(); }
  /// Where it is being made.
  const std::filesystem::path& path() const { return path_; }

  /// Gives it its name. A file or a link that has the name is replaced, never followed; so is an
  /// empty folder by a folder. Throws as PathError does.
  void Publish();

 private:
  void RemoveAbandoned() const;
  /// Opens and locks a name in the folder that is not taken; false if the next one is to be tried.
  bool TryOpen(Kind kind);

  std::filesystem::path target_;  // where it shall stand
  Descriptor folder_;             // what it stands in
  std::string name_;
  std::filesystem::path path_;
  Descriptor descriptor_;
  bool published_ = false;
};

/// Whether a file or folder of this name is one that is being made, or was left behind.
bool IsMakingName(std::string_view name);

}  // namespace upswing
