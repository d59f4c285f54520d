#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace upswing {

/// The bytes of a string.
std::span<const std::byte> BytesOf(std::string_view text);

/// The whole file. Throws BadInput if it cannot be read.
std::vector<std::byte> ReadFile(const std::filesystem::path& path);

/// The whole file as text. Throws BadInput if it cannot be read.
std::string ReadTextFile(const std::filesystem::path& path);

/// The same of a regular file of at most so many bytes. Throws BadInput, too, at once, on what is
/// something else (a pipe, a device, a folder) or longer.
std::string ReadSmallTextFile(const std::filesystem::path& path, size_t most_bytes);

/// Replaces the file by `parts`, one after the other: written to a temporary file beside it,
/// synchronised to disk, then renamed, so that at every moment the old file or the new one is
/// there whole. What is no regular file (a pipe, a device) is written in place. Throws Failure; the
/// old file then stays and the temporary one is removed.
void WriteFileAtomically(const std::filesystem::path& path,
                         std::span<const std::span<const std::byte>> parts);
void WriteFileAtomically(const std::filesystem::path& path, std::string_view text);

/// Throws BadInput, with `advice` in brackets, unless there is nothing at `folder`, or an empty
/// folder; for before work whose result shall go there, so that nothing is overwritten.
void CheckFree(const std::filesystem::path& folder,
               std::string_view advice = "choose another --out");

/// Makes a folder and those above it, where they are not there yet. Throws Failure.
void MakeFolder(const std::filesystem::path& folder);

/// Makes a folder that is new or takes one that is empty. Throws as CheckFree and MakeFolder do.
void MakeNewFolder(const std::filesystem::path& folder);

/// Keeps other processes from working in a folder for as long as it lives, or its process does.
class FolderLock {
 public:
  /// Throws BadInput if another process holds it.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

/// A file that only grows (a log, a CSV). Its size goes into the checkpoint; on resume it is cut
/// back to that size, so that what a killed run wrote after its checkpoint is not there twice.
class AppendFile {
 public:
  /// As a size: whatever is there stays.
  static constexpr int64_t kKeepAll = -1;

  /// Opens or makes the file and cuts it to `size` bytes. Throws Failure, also if it is shorter.
  AppendFile(std::filesystem::path path, int64_t size);
  ~AppendFile();
  AppendFile(AppendFile&& other) noexcept;
  AppendFile& operator=(AppendFile&&) = delete;

  /// Appends all bytes at once. Throws Failure (a full disk).
  void Append(std::span<const std::byte> bytes);
  void Append(std::string_view text) { Append(BytesOf(text)); }

  /// Waits until everything is on disk. Throws Failure.
  void Sync() const;

  /// Bytes so far.
  int64_t size() const { return size_; }

 private:
  std::filesystem::path path_;
  int descriptor_;
  int64_t size_;
};

}  // namespace upswing
