#include "os/file.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <tuple>
#include <utility>

#include "os/system.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Whether an error of a system call is due to its path.
bool IsOfPath(int error_number) {
  constexpr std::array kOfPath{EACCES, EEXIST, EINVAL,  EISDIR,     ELOOP,  ENAMETOOLONG,
                               ENODEV, ENOENT, ENOTDIR, ENXIO,      EPERM,  ENOTEMPTY,
                               EROFS,  EBUSY,  EXDEV,   EOPNOTSUPP, ENOLCK, ENOSYS};
  return std::ranges::find(kOfPath, error_number) != kOfPath.end();
}

void WriteInPlace(const fs::path& path, std::string_view text) {
  const Descriptor fd = system::Open(path, system::Access::kOverwrite);
  if (fd.get() < 0 && errno == ENXIO) {
    throw BadInput(Concat("cannot write ", path.string(), ": expected a file, got a pipe that no ",
                          "program reads"));
  }
  if (fd.get() < 0 || !system::WriteAll(fd.get(), BytesOf(text))) {
    throw PathError("cannot write", path, errno);
  }
}

}  // namespace

Error PathError(std::string_view what, const fs::path& path, int error_number) {
  return {IsOfPath(error_number) ? 2 : 1,
          Concat(what, " ", path.string(), ": ", std::strerror(error_number))};
}

bool Exists(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

bool IsFile(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool IsOwnFile(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(fs::symlink_status(path, error));
}

std::string ReadOwnFile(const fs::path& path, size_t most_bytes) {
  const std::vector<std::byte> bytes = ReadOwnBytes(path, most_bytes);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::vector<std::byte> ReadOwnBytes(const fs::path& path, size_t most_bytes) {
  const Descriptor fd = system::Open(path, system::Access::kRead);
  const auto cannot = [&](std::string_view why) {
    return BadInput(Concat("cannot read ", path.string(), ": ", why));
  };
  std::optional<system::OpenFile> file;
  if (fd.get() >= 0) file = system::Describe(fd.get());
  if (!file) throw cannot(std::strerror(errno));
  using Kind = system::OpenFile::Kind;
  if (file->kind == Kind::kFolder) throw cannot("expected a file, got a folder");
  if (file->kind != Kind::kFile) throw cannot("expected a file, got a pipe or a device");
  const auto expect_fits = [&](uintmax_t size) {
    if (size <= most_bytes) return;
    throw cannot(Concat("expected at most ", most_bytes, " bytes, got ", size));
  };
  expect_fits(static_cast<uintmax_t>(file->size));
  // Read until the end, because a system file reports no size.
  std::vector<std::byte> bytes(static_cast<size_t>(file->size));
  size_t filled = 0;
  while (true) {
    if (filled == bytes.size()) bytes.resize(bytes.size() + 65536);
    const ptrdiff_t got = system::Read(fd.get(), std::span(bytes).subspan(filled));
    if (got < 0) throw cannot(std::strerror(errno));
    if (got == 0) break;
    filled += static_cast<size_t>(got);
    expect_fits(filled);
  }
  bytes.resize(filled);
  return bytes;
}

std::string ReadEnd(const fs::path& path, std::streamoff most_bytes) {
  if (!IsOwnFile(path)) return "";
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return "";
  const std::streamoff size = file.tellg();
  file.seekg(std::max<std::streamoff>(0, size - most_bytes));
  return {std::istreambuf_iterator<char>(file), {}};
}

void WriteFileAtomically(const fs::path& path, std::span<const std::span<const std::byte>> parts) {
  Making file(path, Making::Kind::kFile);
  bool written = true;
  for (const auto part : parts) {
    written = written && system::WriteAll(file.descriptor(), part);
  }
  if (!written || !system::Sync(file.descriptor())) throw PathError("cannot write", path, errno);
  file.Publish();
}

void WriteFileAtomically(const fs::path& path, std::string_view text) {
  WriteFileAtomically(path, std::array{BytesOf(text)});
}

void WriteIfOther(const fs::path& path, const std::string& text) {
  if (!IsOwnFile(path) || ReadOwnFile(path) != text) WriteFileAtomically(path, text);
}

void CheckNoLink(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_symlink(folder, error)) return;
  throw BadInput(Concat(folder.string(), ": expected a folder, got a link"));
}

void WriteNamedFile(const fs::path& path, std::string_view text) {
  std::error_code error;
  const fs::file_status there = fs::status(path, error);
  if (there.type() == fs::file_type::not_found) {
    if (fs::is_symlink(fs::symlink_status(path, error))) {
      throw BadInput(
          Concat("cannot write ", path.string(), ": expected a file, got a link to nothing"));
    }
    return WriteFileAtomically(path, text);
  }
  if (!fs::exists(there)) throw PathError("cannot write", path, error.value());
  if (fs::is_directory(there)) throw PathError("cannot write", path, EISDIR);
  if (!fs::is_regular_file(there)) return WriteInPlace(path, text);
  // Replacing a file needs no right to write it.
  if (!system::MayWrite(path)) throw PathError("cannot write", path, errno);
  WriteFileAtomically(fs::canonical(path), text);
}

void CheckFree(const fs::path& folder, std::string_view advice) {
  std::error_code error;
  const fs::file_status there = fs::symlink_status(folder, error);
  if (!fs::exists(there)) return;
  const bool is_folder = fs::is_directory(folder, error);
  if (is_folder && fs::is_empty(folder, error)) return;
  if (is_folder && error) throw PathError("cannot read", folder, error.value());
  const char* got = "a file";
  if (fs::is_symlink(there) && !fs::exists(folder, error)) got = "a link to nothing";
  if (is_folder) got = "one that is not empty";
  throw BadInput(
      Concat(folder.string(), ": expected a new or empty folder, got ", got, " (", advice, ")"));
}

void MakeNewFolder(const fs::path& folder) {
  CheckFree(folder);
  MakeFolder(folder);
}

fs::path FreePath(const fs::path& path) {
  fs::path free = path;
  for (int number = 2; fs::exists(fs::symlink_status(free)); ++number) {
    free = Concat(path.string(), "-", number);
  }
  return free;
}

void MakeFolder(const fs::path& folder) { NewFolder(folder).Keep(); }

NewFolder::NewFolder(const fs::path& folder) {
  std::vector<fs::path> missing;  // deepest first
  for (fs::path part = folder; !part.empty() && !Exists(part); part = part.parent_path()) {
    missing.push_back(part);
  }
  std::error_code error;
  for (; !missing.empty() && !error; missing.pop_back()) {
    // Another process may be faster, and the folder is its own then.
    if (fs::create_directory(missing.back(), error)) made_.push_back(missing.back());
  }
  if (!error) fs::create_directories(folder, error);
  if (!error) return;
  Remove();
  throw PathError("cannot make the folder", folder, error.value());
}

NewFolder::~NewFolder() { Remove(); }

void NewFolder::Remove() const {
  // Fails where another process has put something.
  std::error_code ignored;
  for (auto part = made_.rbegin(); part != made_.rend(); ++part) fs::remove(*part, ignored);
}

AppendFile::AppendFile(fs::path path) : path_(std::move(path)) {
  descriptor_ = system::Open(path_, system::Access::kAppendNew);
  is_new_ = descriptor_.get() >= 0;
  if (!is_new_ && errno == EEXIST) descriptor_ = system::Open(path_, system::Access::kAppend);
  const auto refuse = [&](std::string_view what) {
    return BadInput(Concat("cannot write ", path_.string(),
                           ": expected a regular file that only this folder has, got ", what));
  };
  if (descriptor_.get() < 0) {
    const int error_number = errno;
    std::error_code error;
    throw error_number == ELOOP && fs::is_symlink(path_, error)
        ? refuse("a link")
        : PathError("cannot write", path_, error_number);
  }
  const auto file = system::Describe(descriptor_.get());
  if (!file) throw PathError("cannot write", path_, errno);
  if (file->kind != system::OpenFile::Kind::kFile) throw refuse("a pipe or a device");
  if (file->names > 1) {
    throw refuse(Concat("one with ", file->names, " names (hard links; a copy would do)"));
  }
  size_ = file->size;
}

void AppendFile::CutTo(int64_t size) {
  if (!system::CutTo(descriptor_.get(), size)) throw PathError("cannot write", path_, errno);
  size_ = size;
}

void AppendFile::Sync() const {
  if (!system::Sync(descriptor_.get())) throw PathError("cannot write", path_, errno);
}

void AppendFile::Append(std::span<const std::byte> bytes) {
  if (!system::WriteAll(descriptor_.get(), bytes)) {
    const int error_number = errno;
    std::ignore = system::CutTo(descriptor_.get(), size_);
    throw PathError("cannot write", path_, error_number);
  }
  size_ += static_cast<int64_t>(bytes.size());
}

}  // namespace upswing
