#pragma once

#include <filesystem>
#include <memory>
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

/// A file or folder under construction. It appears under its name complete or not at all.
///
/// Until then it is locked and has the name `.NAME.making-` plus 16 hexadecimal digits, 8 of this
/// host and 8 random, in the same folder. An unlocked one of this host belonged to a process that
/// was killed; the next Making in the folder removes it. The locks of another host may be invisible
/// here, so one of another host is removed an hour after its last change.
class Making {
 public:
  enum class Kind { kFile, kFolder };

  /// Makes it empty under the temporary name, with a mode from the umask. Throws as PathError does.
  Making(const std::filesystem::path& path, Kind kind);
  /// Removes it unless Publish was called.
  ~Making();
  Making(const Making&) = delete;
  Making& operator=(const Making&) = delete;

  /// Descriptor: of a file open for writing, of a folder open for reading.
  int descriptor() const { return descriptor_.get(); }
  /// Its lock, which outlives this object with a copy; null on a file system without locks.
  const std::shared_ptr<const void>& lock() const { return lock_; }
  /// The final path.
  const std::filesystem::path& target() const { return target_; }
  /// The temporary path.
  const std::filesystem::path& path() const { return path_; }

  /// Gives it the final name. Replaces a file or link of that name and never follows a link. A
  /// folder also replaces an empty folder. Throws as PathError does.
  void Publish();

 private:
  /// Opens the parent folder.
  Descriptor OpenParent() const;
  void RemoveAbandoned() const;
  /// Makes and locks it under its temporary name; false if another name is needed.
  bool TryOpen(Kind kind);

  std::filesystem::path target_;  // final path
  Descriptor folder_;             // parent folder
  std::string name_;
  std::filesystem::path path_;
  Descriptor descriptor_;
  std::shared_ptr<const void> lock_;
  bool published_ = false;
};

/// Removes a folder with its contents; other processes see it vanish in one step. Throws as
/// PathError does.
void RemoveFolder(const std::filesystem::path& folder);

/// Whether `name` is a temporary name of a Making.
bool IsMakingName(std::string_view name);

}  // namespace upswing
