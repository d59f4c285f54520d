#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/file.h"

namespace upswing {

/// TensorBoard's event file: records of protobuf events, framed as in TFRecord with masked CRC-32C.
class EventFile {
 public:
  /// Opens or makes the file; CutTo must follow. Throws as AppendFile does.
  explicit EventFile(const std::filesystem::path& path) : file_(path) {}

  /// Cuts it back to `size` bytes, at most its size; where nothing is left the version record comes
  /// first. Throws Failure.
  void CutTo(int64_t size);

  /// Appends scalars at a step.
  void Append(int64_t step, const std::vector<std::pair<std::string, double>>& scalars);

  int64_t size() const { return file_.size(); }
  const std::filesystem::path& path() const { return file_.path(); }
  /// Waits until everything is on disk. Throws Failure.
  void Sync() const { file_.Sync(); }

 private:
  void AppendRecord(const std::string& payload);

  AppendFile file_;
};

/// CRC-32C (Castagnoli), as RFC 3720 Appendix B.4 tests it.
uint32_t Crc32c(std::string_view bytes);

}  // namespace upswing
