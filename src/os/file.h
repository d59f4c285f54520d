#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ios>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "os/making.h"

namespace upswing {

/// Exists: whether something is at the path. IsFile: whether it is a regular file. IsOwnFile:
/// whether it is a regular file and not a link. All are false if the system cannot tell.
bool Exists(const std::filesystem::path& path);
bool IsFile(const std::filesystem::path& path);
bool IsOwnFile(const std::filesystem::path& path);

/// Error for a system call that failed with `error_number` (errno). `what` describes the failure,
/// such as "cannot write". Returns BadInput if another path could work, such as for a missing
/// folder or permission. Returns Failure if the work itself failed, such as on a full disk.
Error PathError(std::string_view what, const std::filesystem::path& path, int error_number);

/// Size limit for untrusted text files. No run exceeds it: an evaluation takes about 150 bytes.
inline constexpr size_t kMostTextBytes = 1 << 26;

/// Reads a whole file. Every file may come from a stranger, so it must be a regular file of at most
/// `most_bytes`. Anything else, such as a pipe that never ends, throws BadInput without waiting.
std::string ReadOwnFile(const std::filesystem::path& path, size_t most_bytes = kMostTextBytes);
std::vector<std::byte> ReadOwnBytes(const std::filesystem::path& path,
                                    size_t most_bytes = kMostTextBytes);

/// Reads the end of an untrusted file, at most `most_bytes`; empty if it is not a regular file.
std::string ReadEnd(const std::filesystem::path& path, std::streamoff most_bytes);

/// Replaces the file at `path` by the concatenated `parts`. Writes a temporary file next to it (see
/// Making), synchronises that to disk and renames it. At every moment, the old or the new file is
/// complete.
///
/// A link is replaced, not followed. Throws as PathError does. On an error, the old file stays and
/// the temporary file is removed.
void WriteFileAtomically(const std::filesystem::path& path,
                         std::span<const std::span<const std::byte>> parts);
void WriteFileAtomically(const std::filesystem::path& path, std::string_view text);

/// Runs WriteFileAtomically unless the file already has this text.
void WriteIfOther(const std::filesystem::path& path, const std::string& text);

/// Throws BadInput if a folder is a link, because files written there would land elsewhere.
void CheckNoLink(const std::filesystem::path& folder);

/// Writes a file that the user named. Like WriteFileAtomically, but it follows a link and replaces
/// the link's target, and refuses a read-only file. Writes in place if the path is not a regular
/// file, such as a pipe or a device.
void WriteNamedFile(const std::filesystem::path& path, std::string_view text);

/// Throws BadInput, with `advice` in brackets, unless `folder` is missing or empty. Call it before
/// work whose result will be written there, so that nothing is overwritten.
void CheckFree(const std::filesystem::path& folder,
               std::string_view advice = "choose another --out");

/// `path` if nothing is there; otherwise the first free one of `path`-2, `path`-3, ….
std::filesystem::path FreePath(const std::filesystem::path& path);

/// Makes a folder and its missing parents. Throws as PathError does.
void MakeFolder(const std::filesystem::path& folder);

/// A folder whose first use may fail. Makes it and its missing parents. Removes the
/// empty ones of its own folders, unless Keep is called.
class NewFolder {
 public:
  /// Throws as PathError does.
  explicit NewFolder(const std::filesystem::path& folder);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  void Keep() { made_.clear(); }

 private:
  void Remove() const;

  std::vector<std::filesystem::path> made_;  // parents first
};

/// Makes a folder. It may exist if it is empty. Throws as CheckFree and MakeFolder do.
void MakeNewFolder(const std::filesystem::path& folder);

/// A file that only grows, such as a log or a CSV. Its size is saved in the checkpoint. On resume,
/// the file is cut to that size, so that rows written after the checkpoint do not appear twice.
class AppendFile {
 public:
  /// Opens or makes the file. Throws BadInput and changes nothing if the path is a link, has
  /// further names (hard links) or is not a regular file. Such a file could belong to another
  /// folder too. Otherwise throws as PathError does.
  explicit AppendFile(std::filesystem::path path);

  /// Cuts the file to `size` bytes, at most its current size. Throws Failure.
  void CutTo(int64_t size);

  /// Appends all bytes or, as far as the system permits, none. Throws Failure, for example on a
  /// full disk.
  void Append(std::span<const std::byte> bytes);
  void Append(std::string_view text) { Append(BytesOf(text)); }

  /// Waits until everything is on disk. Throws Failure.
  void Sync() const;

  /// Size of the file in bytes.
  int64_t size() const { return size_; }
  /// Whether the constructor made the file.
  bool is_new() const { return is_new_; }
  const std::filesystem::path& path() const { return path_; }
  int descriptor() const { return descriptor_.get(); }

 private:
  std::filesystem::path path_;
  Descriptor descriptor_{-1};
  int64_t size_ = 0;
  bool is_new_ = false;
};

}  // namespace upswing
