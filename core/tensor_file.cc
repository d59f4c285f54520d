#include "core/tensor_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/checksum.h"
#include "core/error.h"
#include "core/file.h"
#include "core/text.h"

namespace upswing {
namespace {

using nlohmann::json;

static_assert(std::endian::native == std::endian::little, "safetensors are little-endian");

struct DtypeFacts {
  Dtype dtype;
  std::string_view name;
  size_t size;
};
constexpr std::array kDtypes{
    DtypeFacts{Dtype::kU8, "U8", 1},   DtypeFacts{Dtype::kF32, "F32", 4},
    DtypeFacts{Dtype::kF64, "F64", 8}, DtypeFacts{Dtype::kI64, "I64", 8},
    DtypeFacts{Dtype::kU64, "U64", 8},
};

const DtypeFacts& FactsOf(Dtype dtype) {
  return *std::find_if(kDtypes.begin(), kDtypes.end(),
                       [&](const DtypeFacts& facts) { return facts.dtype == dtype; });
}

constexpr std::string_view kChecksumKey = "\"checksum\":\"";
constexpr std::string_view kNoChecksum = "0000000000000000";

/// Where the checksum's digits stand in the header; npos if the file has none.
size_t FindChecksum(std::string_view header) {
  const size_t key = header.find(kChecksumKey);
  return key == std::string_view::npos ? key : key + kChecksumKey.size();
}

/// What `shape` needs in bytes; nothing on a negative size or overflow.
std::optional<size_t> ByteCount(const std::vector<int64_t>& shape, Dtype dtype) {
  size_t count = SizeOf(dtype);
  for (const int64_t extent : shape) {
    if (extent < 0) return std::nullopt;
    if (__builtin_mul_overflow(count, static_cast<size_t>(extent), &count)) return std::nullopt;
  }
  return count;
}

/// An entry of the header: a tensor whose bytes are still to be found, and where they begin in the
/// file's data.
struct Entry {
  Tensor tensor;
  size_t begin, size;
};

/// One entry of the header, checked against the size of the file's data.
Entry ParseEntry(const json& entry, size_t data_size) {
  const auto dtype_name = entry.at("dtype").get<std::string>();
  const auto facts = std::find_if(kDtypes.begin(), kDtypes.end(),
                                  [&](const DtypeFacts& f) { return f.name == dtype_name; });
  if (facts == kDtypes.end()) throw std::runtime_error(Concat("type ", dtype_name, " is not ours"));
  Tensor tensor{facts->dtype, entry.at("shape").get<std::vector<int64_t>>(), {}};
  const auto offsets = entry.at("data_offsets").get<std::array<uint64_t, 2>>();
  if (offsets[0] > offsets[1] || offsets[1] > data_size) {
    throw std::runtime_error(Concat("data end at byte ", offsets[1], " of ", data_size));
  }
  const size_t size = offsets[1] - offsets[0];
  if (ByteCount(tensor.shape, tensor.dtype) != size) {
    throw std::runtime_error(Concat("expected the bytes of ", tensor.Describe(), ", got ", size));
  }
  return {std::move(tensor), offsets[0], size};
}

/// Length of the header, which the file's first bytes tell, checked against the size of the file.
uint64_t ParseLength(std::span<const std::byte> first_bytes, uint64_t file_size) {
  uint64_t length = 0;
  if (first_bytes.size() < sizeof(length)) {
    throw std::runtime_error(Concat("it has ", file_size, " bytes"));
  }
  std::memcpy(&length, first_bytes.data(), sizeof(length));
  if (length > file_size - sizeof(length)) {
    throw std::runtime_error(
        Concat("its header should have ", length, " bytes, the file has ", file_size));
  }
  return length;
}

/// What a header says.
struct Header {
  std::map<std::string, std::string> metadata;
  std::map<std::string, Entry> entries;  // of the tensors that were asked for
};

/// Reads a header's JSON object: the metadata, and the tensors whose names begin with `prefix`. The
/// parser's own message would quote bytes that need not be text.
Header ParseHeader(std::string_view text, size_t data_size, std::string_view prefix) {
  const json object = json::parse(text, nullptr, false);
  if (!object.is_object()) throw std::runtime_error("its header is no JSON object");
  Header header;
  for (const auto& [name, entry] : object.items()) {
    if (name == "__metadata__") {
      header.metadata = entry.get<std::map<std::string, std::string>>();
    } else if (name.starts_with(prefix)) {
      try {
        header.entries.emplace(name, ParseEntry(entry, data_size));
      } catch (const std::exception& error) {
        throw std::runtime_error(Concat("tensor \"", name, "\": ", error.what()));
      }
    }
  }
  return header;
}

/// Throws unless the tensors cover the data without gap or overlap.
void CheckCovered(const std::map<std::string, Entry>& entries, size_t data_size) {
  std::vector<std::pair<size_t, size_t>> pieces;  // begin and size
  pieces.reserve(entries.size());
  for (const auto& [name, entry] : entries) pieces.emplace_back(entry.begin, entry.size);
  std::ranges::sort(pieces);
  size_t end = 0;
  for (const auto& [begin, size] : pieces) {
    if (size > 0 && begin != end) throw std::runtime_error("tensors overlap");
    end += size;
  }
  if (end != data_size) throw std::runtime_error(Concat(data_size - end, " bytes too many"));
}

/// Throws at what is no regular file; a pipe, say, would never end. (What is not there is told by
/// who reads it.)
void CheckRegular(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error) || std::filesystem::is_regular_file(path, error))
    return;
  throw BadInput(Concat("cannot read ", path.string(), ": expected a regular file"));
}

Error Broken(const std::string& path, std::string_view why) {
  return BadInput(Concat(path, ": not a whole safetensors file: ", why));
}

}  // namespace

std::string_view NameOf(Dtype dtype) { return FactsOf(dtype).name; }
size_t SizeOf(Dtype dtype) { return FactsOf(dtype).size; }

std::string Tensor::Describe() const {
  std::vector<std::string> extents;
  for (const int64_t extent : shape) extents.push_back(std::to_string(extent));
  return Concat(NameOf(dtype), " [", Join(extents, ", "), "]");
}

const std::string& TensorFile::Metadata(const std::string& key) const {
  const auto found = metadata.find(key);
  if (found == metadata.end()) throw BadInput(Concat(path_, ": no metadata \"", key, "\""));
  return found->second;
}

const Tensor& TensorFile::Find(const std::string& name, Dtype dtype) const {
  const auto found = tensors_.find(name);
  if (found == tensors_.end()) throw BadInput(Concat(path_, ": no tensor \"", name, "\""));
  if (found->second.dtype != dtype) {
    throw BadInput(Concat(path_, ": tensor \"", name, "\": expected ", NameOf(dtype), ", got ",
                          found->second.Describe()));
  }
  return found->second;
}

void TensorFile::ReadBytes(const std::string& name, Dtype dtype, const std::vector<int64_t>& shape,
                           std::span<std::byte> bytes) const {
  const Tensor& tensor = Find(name, dtype);
  const Tensor expected{dtype, shape, {}};
  if (tensor.bytes.size() != bytes.size() || (!shape.empty() && tensor.shape != shape)) {
    throw BadInput(Concat(
        path_, ": tensor \"", name, "\": expected ",
        shape.empty() ? Concat(bytes.size() / SizeOf(dtype), " numbers") : expected.Describe(),
        ", got ", tensor.Describe()));
  }
  if (!bytes.empty()) std::memcpy(bytes.data(), tensor.bytes.data(), bytes.size());
}

void TensorFile::Save(const std::filesystem::path& path) const {
  // Wide types first, so that each tensor is aligned to its own size.
  std::vector<std::pair<std::string, const Tensor*>> order;
  for (const auto& [name, tensor] : tensors_) order.emplace_back(name, &tensor);
  std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
    return SizeOf(a.second->dtype) > SizeOf(b.second->dtype);
  });

  json header;
  header["__metadata__"] = metadata;
  header["__metadata__"]["checksum"] = kNoChecksum;
  size_t offset = 0;
  for (const auto& [name, tensor] : order) {
    const size_t end = offset + tensor->bytes.size();
    header[name] = {{"dtype", NameOf(tensor->dtype)},
                    {"shape", tensor->shape},
                    {"data_offsets", {offset, end}}};
    offset = end;
  }
  std::string text = header.dump();
  text.resize((text.size() + 7) / 8 * 8, ' ');

  // The checksum covers everything behind the length, with zeros where it will stand itself.
  Checksum checksum;
  checksum.Update(BytesOf(text));
  for (const auto& [name, tensor] : order) checksum.Update(tensor->bytes);
  text.replace(FindChecksum(text), kNoChecksum.size(), checksum.Hex());

  const uint64_t length = text.size();
  std::vector<std::span<const std::byte>> parts{std::as_bytes(std::span(&length, 1)),
                                                BytesOf(text)};
  for (const auto& [name, tensor] : order) parts.push_back(tensor->bytes);
  WriteFileAtomically(path, parts);
}

TensorFile TensorFile::Load(const std::filesystem::path& path) {
  CheckRegular(path);
  return Parse(ReadFile(path), path.string());
}

TensorFile TensorFile::Parse(std::vector<std::byte> content, std::string where) {
  TensorFile file;
  file.path_ = std::move(where);
  const auto& bytes = file.kept_.emplace_back(std::move(content));
  std::string text;  // of the header
  try {
    const uint64_t length = ParseLength(bytes, bytes.size());
    text.assign(reinterpret_cast<const char*>(bytes.data()) + sizeof(length), length);
    const auto data = std::span(bytes).subspan(sizeof(length) + length);
    Header header = ParseHeader(text, data.size(), "");
    CheckCovered(header.entries, data.size());
    file.metadata = std::move(header.metadata);
    for (auto& [name, entry] : header.entries) {
      entry.tensor.bytes = data.subspan(entry.begin, entry.size);
      file.tensors_[name] = std::move(entry.tensor);
    }
  } catch (const std::exception& error) {
    throw Broken(file.path_, error.what());
  }

  // The checksum, where a writer left one.
  if (const size_t at = FindChecksum(text); at != std::string::npos) {
    const std::string expected = text.substr(at, kNoChecksum.size());
    text.replace(at, kNoChecksum.size(), kNoChecksum);
    Checksum checksum;
    checksum.Update(BytesOf(text));
    // Tensor by tensor, as Save did: a tensor's last word is padded.
    std::vector<const Tensor*> order;
    for (const auto& [name, tensor] : file.tensors_) order.push_back(&tensor);
    std::sort(order.begin(), order.end(),
              [](const Tensor* a, const Tensor* b) { return a->bytes.data() < b->bytes.data(); });
    for (const Tensor* tensor : order) checksum.Update(tensor->bytes);
    if (checksum.Hex() != expected) {
      throw Broken(file.path_, Concat("its checksum is ", checksum.Hex(), ", expected ", expected));
    }
    file.metadata.erase("checksum");
  }
  return file;
}

TensorFile TensorFile::LoadPart(const std::filesystem::path& path, std::string_view prefix) {
  TensorFile part;
  part.path_ = path.string();
  CheckRegular(path);
  std::ifstream file(path, std::ios::binary);
  std::error_code error;
  const uint64_t file_size = std::filesystem::file_size(path, error);
  if (!file || error) throw BadInput(Concat("cannot read ", part.path_));
  const auto read = [&](uint64_t from, std::span<std::byte> bytes) {
    file.seekg(static_cast<std::streamoff>(from));
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!file) throw std::runtime_error("it became shorter while it was read");
  };
  try {
    std::vector<std::byte> first(std::min<uint64_t>(sizeof(uint64_t), file_size));
    read(0, first);
    const uint64_t length = ParseLength(first, file_size);
    std::string text(length, '\0');
    read(first.size(), std::as_writable_bytes(std::span(text)));
    const uint64_t data_begin = first.size() + length;
    Header header = ParseHeader(text, file_size - data_begin, prefix);
    part.metadata = std::move(header.metadata);
    for (auto& [name, entry] : header.entries) {
      auto& bytes = part.kept_.emplace_back(entry.size);
      read(data_begin + entry.begin, bytes);
      entry.tensor.bytes = bytes;
      part.tensors_[name] = std::move(entry.tensor);
    }
  } catch (const std::exception& problem) {
    throw Broken(part.path_, problem.what());
  }
  part.metadata.erase("checksum");
  return part;
}

}  // namespace upswing
