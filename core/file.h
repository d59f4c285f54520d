#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/making.h"

namespace upswing {

/// The bytes of a string.
std::span<const std::byte> BytesOf(std::string_view text);

/// The whole file. Throws BadInput if it cannot be read.
std::vector<std::byte> ReadFile(const std::filesystem::path& path);

/// The whole file as text. Throws BadInput if it cannot be read.
std::string ReadTextFile(const std::filesystem::path& path);

/// What to throw where the system refuses to do `what` (such as "cannot write") with a path, which
/// says so in `error_number` (errno): BadInput where another path would have done, as where there
/// is no such folder or no permission; Failure where the work itself failed, as on a full disk.
Error PathError(std::string_view what, const std::filesystem::path& path, int error_number);

/// A file that may come from anybody, as those of a run folder and models: only a regular file of
/// at most `most_bytes` is read, for a pipe might never end. Throws BadInput, at once, at all else.
std::string ReadOwnFile(const std::filesystem::path& path,
                        size_t most_bytes = std::numeric_limits<size_t>::max());

/// Replaces what has this path by a file of `parts`, one after the other: written to a temporary
/// file beside it (see Making), synchronised to disk, then renamed, so that at every moment the old
/// file or the new one is there whole. A link is replaced, not followed. Throws as PathError does;
/// the old file then stays and the temporary one is removed.
void WriteFileAtomically(const std::filesystem::path& path,
                         std::span<const std::span<const std::byte>> parts);
void WriteFileAtomically(const std::filesystem::path& path, std::string_view text);

/// Writes a file that the user named. As WriteFileAtomically, but for what is there already: of a
/// link, the file that it leads to is replaced, and what is no regular file (a pipe, a device) is
/// written in place.
void WriteNamedFile(const std::filesystem::path& path, std::string_view text);

/// Throws BadInput, with `advice` in brackets, unless there is nothing at `folder`, or an empty
/// folder; for before work whose result shall go there, so that nothing is overwritten.
void CheckFree(const std::filesystem::path& folder,
               std::string_view advice = "choose another --out");

/// Makes a folder and those above it, where they are not there yet. Throws as PathError does.
void MakeFolder(const std::filesystem::path& folder);

/// Makes a folder that is new or takes one that is empty. Throws as CheckFree and MakeFolder do.
void MakeNewFolder(const std::filesystem::path& folder);

/// Keeps other processes from working in a folder for as long as it lives, or its process does.
class FolderLock {
 public:
  /// Throws BadInput if another process holds it.
  explicit FolderLock(const std::filesystem::path& folder);

 private:
  Descriptor descriptor_;
};

/// A file that only grows (a log, a CSV). Its size goes into the checkpoint; on resume it is cut
/// back to that size, so that what a killed run wrote after its checkpoint is not there twice.
class AppendFile {
 public:
  /// Opens or makes the file. Throws BadInput, with nothing changed, at a link, at a file that has
  /// other names besides (hard links), and at what is no regular file: it is not of the folder
  /// alone. Else throws as PathError does.
  explicit AppendFile(std::filesystem::path path);

  /// Cuts it back to `size` bytes, at most its size. Throws Failure.
  void CutTo(int64_t size);

  /// Appends all bytes at once. Throws Failure (a full disk).
  void Append(std::span<const std::byte> bytes);
  void Append(std::string_view text) { Append(BytesOf(text)); }

  /// Waits until everything is on disk. Throws Failure.
  void Sync() const;

  /// Bytes so far.
  int64_t size() const { return size_; }
  const std::filesystem::path& path() const { return path_; }
  int descriptor() const { return descriptor_.get(); }

 private:
  std::filesystem::path path_;
  Descriptor descriptor_;
  int64_t size_ = 0;
};

}  // namespace upswing
