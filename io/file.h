#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ios>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/text.h"
#include "io/making.h"

namespace upswing {

/// Whether the path exists, is a regular file, or is a regular file and no link; false if that
/// cannot be found out.
bool Exists(const std::filesystem::path& path);
bool IsFile(const std::filesystem::path& path);
bool IsOwnFile(const std::filesystem::path& path);

/// The whole file. Throws BadInput if it cannot be read.
std::vector<std::byte> ReadFile(const std::filesystem::path& path);

/// The whole file as text. Throws BadInput if it cannot be read.
std::string ReadTextFile(const std::filesystem::path& path);

/// The error to throw if a system call failed with `error_number` (errno) to do `what` (such as
/// "cannot write") with a path: BadInput if another path would have worked, as where a folder or
/// permission is missing; Failure if the work itself failed, as on a full disk.
Error PathError(std::string_view what, const std::filesystem::path& path, int error_number);

/// The size of an untrusted text file that no run exceeds: an evaluation takes some 150 bytes.
inline constexpr size_t kMostTextBytes = 1 << 26;

/// The whole of an untrusted file, such as those of run folders and models: only a regular file of
/// at most `most_bytes`, as a pipe might never end. Throws BadInput, without waiting, for all else.
std::string ReadOwnFile(const std::filesystem::path& path, size_t most_bytes = kMostTextBytes);
std::vector<std::byte> ReadOwnBytes(const std::filesystem::path& path, size_t most_bytes);

/// The end of an untrusted file, at most `most_bytes`; empty if it is no regular file.
std::string ReadEnd(const std::filesystem::path& path, std::streamoff most_bytes);

/// Replaces the file at this path by one of `parts`, one after the other: written to a temporary
/// file beside it (see Making), synchronised to disk, then renamed, so that at every moment either
/// the old file or the new one is complete. A link is replaced, not followed. Throws as PathError
/// does; the old file then stays and the temporary one is removed.
void WriteFileAtomically(const std::filesystem::path& path,
                         std::span<const std::span<const std::byte>> parts);
void WriteFileAtomically(const std::filesystem::path& path, std::string_view text);

/// The same, unless there is a file of this text already.
void WriteIfOther(const std::filesystem::path& path, const std::string& text);

/// Throws BadInput if a folder is a link: what is written there would land elsewhere.
void CheckNoLink(const std::filesystem::path& folder);

/// Writes a file that the user named. Like WriteFileAtomically, except that a link is followed and
/// its target replaced, and that something else than a regular file (a pipe, a device) is written
/// in place.
void WriteNamedFile(const std::filesystem::path& path, std::string_view text);

/// Throws BadInput, with `advice` in brackets, unless `folder` does not exist or is empty. To be
/// called before work whose result will be written there, so that nothing is overwritten.
void CheckFree(const std::filesystem::path& folder,
               std::string_view advice = "choose another --out");

/// `path` if nothing is there, else the first free one of `path`-2, `path`-3, ….
std::filesystem::path FreePath(const std::filesystem::path& path);

/// Makes a folder and its missing parents. Throws as PathError does.
void MakeFolder(const std::filesystem::path& folder);

/// Makes a folder, which may exist if it is empty. Throws as CheckFree and MakeFolder do.
void MakeNewFolder(const std::filesystem::path& folder);

/// That another process works in a folder.
class FolderBusy : public Error {
 public:
  explicit FolderBusy(const std::string& message) : Error(2, message) {}
};

/// Keeps other processes from working in a folder during its lifetime.
class FolderLock {
 public:
  /// Throws FolderBusy if another process holds the lock, else as PathError does.
  explicit FolderLock(const std::filesystem::path& folder);

 private:
  Descriptor descriptor_;
};

/// A file that only grows (a log, a CSV). Its size is saved in the checkpoint; on resume it is cut
/// back to that size, so that what a killed run wrote after its checkpoint does not appear twice.
class AppendFile {
 public:
  /// Opens or makes the file. Throws BadInput, with nothing changed, if it is a link, has further
  /// names (hard links) or is not a regular file, as it may then belong to another folder too. Else
  /// throws as PathError does.
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
