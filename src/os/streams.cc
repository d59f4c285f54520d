#include "os/streams.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "base/error.h"
#include "base/text.h"
#include "os/file.h"
#include "os/system.h"

namespace upswing {

bool StartsWithOneOf(const std::string& path, const std::vector<std::string>& beginnings) {
  std::ifstream file(path, std::ios::binary);
  std::string start(256, '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  return std::ranges::any_of(beginnings,
                             [&](const std::string& text) { return start.starts_with(text); });
}

std::string InputName(const std::string& path) {
  return IsStandardStream(path) ? "standard input" : path;
}

std::string ReadInput(const std::string& path) {
  if (!IsStandardStream(path)) return ReadOwnFile(path);
  std::string text;
  std::array<char, 65536> buffer;
  while (const size_t got = std::fread(buffer.data(), 1, buffer.size(), stdin)) {
    text.append(buffer.data(), got);
    if (text.size() <= kMostTextBytes) continue;
    throw BadInput(Concat("cannot read standard input: expected at most ", kMostTextBytes,
                          " bytes, got more"));
  }
  if (std::ferror(stdin) != 0) {
    throw BadInput(Concat("cannot read standard input: ", std::strerror(errno)));
  }
  return text;
}

void CheckWritable(const std::string& flag, const std::string& path) {
  if (IsStandardStream(path)) return;
  std::error_code error;
  const auto cannot = [&](std::string_view why) {
    return BadInput(Concat(flag, " ", path, ": expected a file that can be written: ", why));
  };
  if (std::filesystem::is_directory(path, error)) throw cannot("it is a folder");
  if (std::filesystem::exists(path, error)) {
    if (!system::MayWrite(path)) throw cannot(std::strerror(errno));
    return;
  }
  if (std::filesystem::is_symlink(path, error)) throw cannot("it is a link to nothing");
  if (system::Open(path, system::Access::kAppendNew).get() < 0) throw cannot(std::strerror(errno));
  system::Remove(path);
}

void CheckNewOutput(const std::string& flag, const std::string& path, bool overwrite) {
  std::error_code error;
  if (!overwrite && !IsStandardStream(path) && std::filesystem::is_regular_file(path, error)) {
    throw BadInput(Concat(flag, " ", path,
                          ": expected a new file, got one that exists; --overwrite replaces it"));
  }
  CheckWritable(flag, path);
}

void CheckReplaceable(const std::string& flag, const std::string& path, std::string_view kind,
                      const std::vector<std::string>& beginnings) {
  CheckWritable(flag, path);
  std::error_code error;
  const bool exists = !IsStandardStream(path) && std::filesystem::is_regular_file(path, error);
  if (exists && std::filesystem::file_size(path, error) > 0 && !StartsWithOneOf(path, beginnings)) {
    throw BadInput(Concat(flag, " ", path, ": expected a new file or an older ", kind,
                          ", got another file; choose another name or remove it"));
  }
}

void WriteOutput(const std::string& path, std::string_view text) {
  if (IsStandardStream(path)) {
    std::fwrite(text.data(), 1, text.size(), stdout);  // main() reports a failure
  } else {
    WriteNamedFile(path, text);
  }
}

}  // namespace upswing
