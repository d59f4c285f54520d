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
  /// Opens or makes the file and cuts it to `size` bytes; a new one gets its version record.
  EventFile(const std::filesystem::path& path, int64_t size);

  /// Appends scalars at a step.
  void Append(int64_t step, const std::vector<std::pair<std::string, double>>& scalars);

  int64_t size() const { return file_.size(); }
  /// Waits until everything is on disk. Throws Failure.
  void Sync() const { file_.Sync(); }

 private:
  void AppendRecord(const std::string& payload);

  AppendFile file_;
};

/// CRC-32C (Castagnoli), as RFC 3720 Appendix B.4 tests it.
uint32_t Crc32c(std::string_view bytes);

}  // namespace upswing
