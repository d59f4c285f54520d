#include "core/tensor_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <optional>

#include "core/checksum.h"
#include "core/error.h"
#include "core/file.h"
#include "core/json.h"
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

constexpr uint64_t kMaxHeader = 1 << 20;  // bytes
constexpr size_t kMaxRank = 8;            // numbers in a shape
constexpr std::string_view kChecksumKey = "\"checksum\":\"";
constexpr std::string_view kNoChecksum = "0000000000000000";

/// Where the checksum's digits stand in the header; npos if the file has none.
size_t FindChecksum(std::string_view header) {
  const size_t key = header.find(kChecksumKey);
  return key == std::string_view::npos ? key : key + kChecksumKey.size();
}

/// Bytes of a tensor of this shape; nothing on a negative size or overflow.
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

/// The integers of a list in an entry. Throws BadInput.
std::vector<int64_t> Integers(const json& entry, const std::string& name, size_t max_size) {
  std::vector<int64_t> integers;
  for (const json& item : JsonList(entry, name, max_size)) {
    const std::optional<int64_t> integer = JsonInteger(item);
    if (!integer) throw BadInput(Concat("\"", name, "\": expected integers, got ", item.dump()));
    integers.push_back(*integer);
  }
  return integers;
}

/// One entry of the header, checked against the size of the file's data. Throws BadInput.
Entry ParseEntry(const json& entry, size_t data_size) {
  if (!entry.is_object()) throw BadInput("expected dtype, shape and data_offsets");
  const std::string& dtype_name = JsonText(entry, "dtype");
  const auto facts = std::find_if(kDtypes.begin(), kDtypes.end(),
                                  [&](const DtypeFacts& f) { return f.name == dtype_name; });
  if (facts == kDtypes.end()) throw BadInput(Concat("type ", dtype_name, " is not ours"));
  Tensor tensor{facts->dtype, Integers(entry, "shape", kMaxRank), {}};
  const std::vector<int64_t> offsets = Integers(entry, "data_offsets", 2);
  if (offsets.size() != 2 || offsets[0] < 0 || offsets[0] > offsets[1]) {
    throw BadInput("\"data_offsets\": expected where its data begin and end");
  }
  const auto begin = static_cast<uint64_t>(offsets[0]);
  const auto end = static_cast<uint64_t>(offsets[1]);
  if (end > data_size) throw BadInput(Concat("data end at byte ", end, " of ", data_size));
  if (ByteCount(tensor.shape, tensor.dtype) != end - begin) {
    throw BadInput(Concat("expected the bytes of ", tensor.Describe(), ", got ", end - begin));
  }
  return {std::move(tensor), begin, end - begin};
}

/// Length of the header, from the file's first bytes, checked against the size of the file.
/// Throws BadInput.
uint64_t ParseLength(std::span<const std::byte> first_bytes, uint64_t file_size) {
  uint64_t length = 0;
  if (first_bytes.size() < sizeof(length)) throw BadInput(Concat("it has ", file_size, " bytes"));
  std::memcpy(&length, first_bytes.data(), sizeof(length));
  if (length > file_size - sizeof(length)) {
    throw BadInput(Concat("its header should have ", length, " bytes, the file has ", file_size));
  }
  if (length > kMaxHeader) {
    throw BadInput(Concat("its header has ", length, " bytes, expected at most ", kMaxHeader));
  }
  return length;
}

/// The contents of a header.
struct Header {
  std::map<std::string, std::string> metadata;
  std::map<std::string, Entry> entries;  // of the tensors
};

/// Throws BadInput unless the tensors cover the data without gap or overlap, so that what is read
/// of a file is never more than the file.
void CheckCovered(const std::map<std::string, Entry>& entries, size_t data_size) {
  std::vector<std::pair<size_t, size_t>> pieces;  // begin and size
  pieces.reserve(entries.size());
  for (const auto& [name, entry] : entries) pieces.emplace_back(entry.begin, entry.size);
  std::ranges::sort(pieces);
  size_t end = 0;
  for (const auto& [begin, size] : pieces) {
    if (size > 0 && begin != end) throw BadInput("tensors overlap");
    end += size;
  }
  if (end != data_size) throw BadInput(Concat(data_size - end, " bytes too many"));
}

/// Reads a header's JSON object. Throws BadInput.
Header ParseHeader(std::string_view text, size_t data_size) {
  json object;
  try {
    object = ParseJsonObject(text);
  } catch (const Error& error) {
    throw BadInput(Concat("its header: ", error.what()));
  }
  Header header;
  for (const auto& [name, entry] : object.items()) {
    try {
      if (name != "__metadata__") {
        header.entries.emplace(name, ParseEntry(entry, data_size));
        continue;
      }
      if (!entry.is_object()) throw BadInput("expected a JSON object");
      for (const auto& [key, value] : entry.items()) header.metadata[key] = JsonText(entry, key);
    } catch (const Error& error) {
      throw BadInput(Concat(name == "__metadata__" ? name : Concat("tensor \"", name, "\""), ": ",
                            error.what()));
    }
  }
  CheckCovered(header.entries, data_size);
  return header;
}

/// Throws BadInput for anything but a regular file: a pipe might never end. (That a file is missing
/// is reported by the reader.)
void CheckRegular(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error) || std::filesystem::is_regular_file(path, error))
    return;
  throw BadInput(Concat("cannot read ", path.string(), ": expected a regular file"));
}

Error Broken(const std::string& path, std::string_view why) {
  return BadInput(Concat(path, ": not a whole safetensors file: ", why));
}

/// The text of a header, padded to whole words. Throws Failure if it would be too long to load or
/// is not UTF-8.
std::string HeaderText(const json& header, const std::filesystem::path& path) {
  try {
    std::string text = header.dump();
    text.resize((text.size() + 7) / 8 * 8, ' ');
    if (text.size() <= kMaxHeader) return text;
    throw Failure(Concat("cannot write ", path.string(),
                         ": expected names and metadata of at most ", kMaxHeader, " bytes, got ",
                         text.size()));
  } catch (const json::exception&) {
    throw Failure(Concat("cannot write ", path.string(), ": expected metadata in UTF-8"));
  }
}

/// Throws BadInput unless `header`, the text of a file's header, holds the checksum of itself (with
/// zeros in place of the checksum) and of `tensors`.
void VerifyChecksum(std::string header, const std::map<std::string, Tensor>& tensors) {
  const size_t at = FindChecksum(header);
  if (at == std::string::npos) throw BadInput("its checksum is not where Upswing writes it");
  const std::string expected = header.substr(at, kNoChecksum.size());
  header.replace(at, kNoChecksum.size(), kNoChecksum);
  Checksum checksum;
  checksum.Update(BytesOf(header));
  // Tensor by tensor, as Save did: a tensor's last word is padded.
  std::vector<const Tensor*> order;
  for (const auto& [name, tensor] : tensors) order.push_back(&tensor);
  std::sort(order.begin(), order.end(),
            [](const Tensor* a, const Tensor* b) { return a->bytes.data() < b->bytes.data(); });
  for (const Tensor* tensor : order) checksum.Update(tensor->bytes);
  if (checksum.Hex() == expected) return;
  throw BadInput(Concat("its checksum is ", checksum.Hex(), ", expected ", expected));
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

void TensorFile::Expect(const std::string& name, Dtype dtype,
                        const std::vector<int64_t>& shape) const {
  const Tensor& tensor = Find(name, dtype);
  if (tensor.shape == shape) return;
  const Tensor expected{dtype, shape, {}};
  throw BadInput(Concat(path_, ": tensor \"", name, "\": expected ", expected.Describe(), ", got ",
                        tensor.Describe()));
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
  if (!shape.empty()) Expect(name, dtype, shape);
  const Tensor& tensor = Find(name, dtype);
  if (tensor.bytes.size() != bytes.size()) {
    throw BadInput(Concat(path_, ": tensor \"", name, "\": expected ", bytes.size() / SizeOf(dtype),
                          " numbers, got ", tensor.Describe()));
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
  std::string text = HeaderText(header, path);

  // The checksum covers everything after the length, with zeros in its own place.
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
  try {
    const uint64_t length = ParseLength(bytes, bytes.size());
    const std::string text(reinterpret_cast<const char*>(bytes.data()) + sizeof(length), length);
    const auto data = std::span(bytes).subspan(sizeof(length) + length);
    Header header = ParseHeader(text, data.size());
    file.metadata = std::move(header.metadata);
    for (auto& [name, entry] : header.entries) {
      entry.tensor.bytes = data.subspan(entry.begin, entry.size);
      file.tensors_[name] = std::move(entry.tensor);
    }
    file.has_checksum_ = file.metadata.contains("checksum");
    if (file.has_checksum_) VerifyChecksum(text, file.tensors_);
    if (!file.has_checksum_ && file.metadata.contains("upswing_version")) {
      throw BadInput("it has an upswing_version, but no checksum, which Upswing always writes");
    }
  } catch (const Error& error) {
    throw Broken(file.path_, error.what());
  }
  file.metadata.erase("checksum");
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
    if (!file) throw BadInput("it became shorter while it was read");
  };
  try {
    std::vector<std::byte> first(std::min<uint64_t>(sizeof(uint64_t), file_size));
    read(0, first);
    const uint64_t length = ParseLength(first, file_size);
    std::string text(length, '\0');
    read(first.size(), std::as_writable_bytes(std::span(text)));
    const uint64_t data_begin = first.size() + length;
    Header header = ParseHeader(text, file_size - data_begin);
    part.metadata = std::move(header.metadata);
    for (auto& [name, entry] : header.entries) {
      if (!name.starts_with(prefix)) continue;
      auto& bytes = part.kept_.emplace_back(entry.size);
      read(data_begin + entry.begin, bytes);
      entry.tensor.bytes = bytes;
      part.tensors_[name] = std::move(entry.tensor);
    }
  } catch (const Error& problem) {
    throw Broken(part.path_, problem.what());
  }
  part.metadata.erase("checksum");
  return part;
}

}  // namespace upswing
