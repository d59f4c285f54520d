#include "runs/tensor_file.h"

#include <algorithm>
#include <fstream>

#include "base/error.h"
#include "base/safetensors.h"
#include "base/text.h"
#include "os/file.h"
#include "os/host.h"

namespace upswing {

void SaveTensors(const Tensors& tensors, const std::filesystem::path& path) {
  const Safetensors written = WriteSafetensors(tensors);
  std::vector<std::span<const std::byte>> parts{written.head};
  parts.insert(parts.end(), written.bodies.begin(), written.bodies.end());
  WriteFileAtomically(path, parts);
}

Tensors LoadTensors(const std::filesystem::path& path, size_t most_bytes) {
  // The header tells whether the file is worth its memory. A sparse file can claim any size.
  if (IsFile(path)) (void)LoadPartOfTensors(path, "a prefix of no tensor");
  const auto memory = static_cast<size_t>(AvailableMemory());
  return ReadSafetensors(ReadOwnBytes(path, std::min(most_bytes, memory)), path.string());
}

Tensors LoadPartOfTensors(const std::filesystem::path& path, std::string_view prefix) {
  Tensors part(path.string());
  // Anything else, such as a pipe, may never end.
  if (!IsFile(path))
    throw BadInput(Concat("cannot read ", part.where(), ": expected a regular file"));
  std::ifstream file(path, std::ios::binary);
  std::error_code error;
  const uint64_t file_size = std::filesystem::file_size(path, error);
  if (!file || error) throw BadInput(Concat("cannot read ", part.where()));
  const auto read = [&](uint64_t from, std::span<std::byte> bytes) {
    file.seekg(static_cast<std::streamoff>(from));
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!file) throw BadInput("the file shrank while it was read");
  };
  try {
    std::vector<std::byte> first(std::min<uint64_t>(sizeof(uint64_t), file_size));
    read(0, first);
    const uint64_t length = ReadSafetensorsLength(first, file_size);
    std::string text(length, '\0');
    read(first.size(), std::as_writable_bytes(std::span(text)));
    const uint64_t data_begin = first.size() + length;
    SafetensorsHeader header = ReadSafetensorsHeader(text, file_size - data_begin);
    part.metadata = std::move(header.metadata);
    uint64_t total = 0;
    for (auto& [name, entry] : header.entries) {
      if (!name.starts_with(prefix)) continue;
      total += entry.size;
      if (total > kMostTextBytes) {
        throw BadInput(
            Concat("tensors ", prefix, "…: expected at most ", kMostTextBytes, " bytes, got more"));
      }
      std::vector<std::byte> bytes(entry.size);
      read(data_begin + entry.begin, bytes);
      entry.tensor.bytes = part.Keep(std::move(bytes));
      part.Add(name, std::move(entry.tensor));
    }
  } catch (const Error& problem) {
    throw BrokenSafetensors(part.where(), problem.what());
  }
  part.metadata.erase("checksum");
  return part;
}

}  // namespace upswing
