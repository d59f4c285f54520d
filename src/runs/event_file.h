#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "os/file.h"

namespace upswing {

/// TensorBoard's event file: records of protobuf events, framed as in TFRecord with masked CRC-32C.
class EventFile {
 public:
  /// Opens or makes the file. Call CutTo next. Throws as AppendFile does.
  explicit EventFile(const std::filesystem::path& path) : file_(path) {}

  /// Cuts the file to `size` bytes, at most its current size. Writes the version record if `size`
  /// is 0. Throws Failure.
  void CutTo(int64_t size);

  /// Appends scalars (tag, value) at a step. Throws Failure.
  void Append(int64_t step, const std::vector<std::pair<std::string, double>>& scalars);

  int64_t size() const { return file_.size(); }
  const std::filesystem::path& path() const { return file_.path(); }
  /// Waits until everything is on disk. Throws Failure.
  void Sync() const { file_.Sync(); }

 private:
  void AppendRecord(const std::string& payload);

  AppendFile file_;
};

/// CRC-32C (Castagnoli), see the examples in RFC 3720, Appendix B.4.
uint32_t Crc32c(std::string_view bytes);

}  // namespace upswing
