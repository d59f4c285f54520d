#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "os/file.h"

namespace upswing {

/// Appends scalars (tag, value) at a step to TensorBoard's event file: records of protobuf events,
/// framed as in TFRecord with masked CRC-32C. An empty file first gets the version record. Throws
/// Failure.
void AppendEvent(AppendFile& file, int64_t step,
                 const std::vector<std::pair<std::string, double>>& scalars);

/// CRC-32C (Castagnoli), see the examples in RFC 3720, Appendix B.4.
uint32_t Crc32c(std::string_view bytes);

}  // namespace upswing
