#include "runs/event_file.h"

#include <event.pb.h>  // generated from runs/event.proto

#include <array>
#include <chrono>
#include <cstring>

namespace upswing {
namespace {

constexpr std::array<uint32_t, 256> kCrcTable = [] {
  std::array<uint32_t, 256> table{};
  for (uint32_t i = 0; i < table.size(); ++i) {
    uint32_t crc = i;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (crc & 1 ? 0x82f63b78U : 0U);
    table[i] = crc;
  }
  return table;
}();

/// Rotates a checksum and adds a constant, as TFRecord does for data that may contain checksums.
uint32_t MaskedCrc(std::string_view bytes) {
  const uint32_t crc = Crc32c(bytes);
  return ((crc >> 15) | (crc << 17)) + 0xa282ead8U;
}

template <typename T>
std::string BytesOfNumber(T number) {
  std::string bytes(sizeof(number), '\0');
  std::memcpy(bytes.data(), &number, sizeof(number));
  return bytes;
}

tensorboard::Event EventNow() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  tensorboard::Event event;
  event.set_wall_time(std::chrono::duration<double>(now).count());
  return event;
}

std::string RecordOf(const tensorboard::Event& event) {
  const std::string payload = event.SerializeAsString();
  const std::string length = BytesOfNumber<uint64_t>(payload.size());
  return length + BytesOfNumber(MaskedCrc(length)) + payload + BytesOfNumber(MaskedCrc(payload));
}

}  // namespace

uint32_t Crc32c(std::string_view bytes) {
  uint32_t crc = 0xffffffff;
  for (const char c : bytes) {
    crc = (crc >> 8) ^ kCrcTable[(crc ^ static_cast<unsigned char>(c)) & 0xff];
  }
  return ~crc;
}

void AppendEvent(AppendFile& file, int64_t step,
                 const std::vector<std::pair<std::string, double>>& scalars) {
  std::string records;
  if (file.size() == 0) {
    tensorboard::Event version = EventNow();
    version.set_file_version("brain.Event:2");
    records = RecordOf(version);
  }
  tensorboard::Event event = EventNow();
  event.set_step(step);
  for (const auto& [tag, scalar] : scalars) {
    auto* value = event.mutable_summary()->add_value();
    value->set_tag(tag);
    value->set_simple_value(static_cast<float>(scalar));
  }
  file.Append(records + RecordOf(event));
}

}  // namespace upswing
