#include "base/safetensors.h"

#include <algorithm>
#include <bit>
#include <compare>
#include <cstring>
#include <optional>

#include "base/checksum.h"
#include "base/json.h"
#include "base/text.h"

namespace upswing {
namespace {

using nlohmann::json;

static_assert(std::endian::native == std::endian::little, "safetensors are little-endian");

constexpr uint64_t kMaxHeader = 1 << 20;  // bytes
constexpr size_t kMaxRank = 8;            // numbers in a shape
constexpr std::string_view kChecksumKey = "\"checksum\":\"";
constexpr std::string_view kNoChecksum = "0000000000000000";

/// Position of the checksum's digits in the header; npos if the file has no checksum.
size_t FindChecksum(std::string_view header) {
  const size_t key = header.find(kChecksumKey);
  return key == std::string_view::npos ? key : key + kChecksumKey.size();
}

/// Number of bytes of a tensor of this shape; nothing if a size is negative or the product
/// overflows.
std::optional<uint64_t> ByteCount(const std::vector<int64_t>& shape, Dtype dtype) {
  uint64_t count = SizeOf(dtype);
  for (const int64_t extent : shape) {
    if (extent < 0) return std::nullopt;
    if (__builtin_mul_overflow(count, static_cast<uint64_t>(extent), &count)) return std::nullopt;
  }
  return count;
}

/// Reads a list of integers from an entry of the header. Throws BadInput.
std::vector<int64_t> Integers(const json& entry, const std::string& name, size_t max_size) {
  std::vector<int64_t> integers;
  for (const json& item : JsonList(entry, name, max_size)) {
    const std::optional<int64_t> integer = JsonInteger(item);
    if (!integer) throw BadInput(Concat("\"", name, "\": expected integers, got ", item.dump()));
    integers.push_back(*integer);
  }
  return integers;
}

/// Parses an entry of the header and checks it against the size of the file's data. Throws
/// BadInput.
SafetensorsEntry ParseEntry(const json& entry, size_t data_size) {
  if (!entry.is_object()) throw BadInput("expected an object of dtype, shape and data_offsets");
  const std::string& dtype_name = JsonText(entry, "dtype");
  const std::optional<Dtype> dtype = DtypeCalled(dtype_name);
  if (!dtype) throw BadInput(Concat("dtype: expected a known type, got ", dtype_name));
  Tensor tensor{*dtype, Integers(entry, "shape", kMaxRank), {}};
  const std::vector<int64_t> offsets = Integers(entry, "data_offsets", 2);
  if (offsets.size() != 2 || offsets[0] < 0 || offsets[0] > offsets[1]) {
    throw BadInput("\"data_offsets\": expected two bytes, begin and end of the data");
  }
  if (static_cast<uint64_t>(offsets[1]) > data_size) {
    throw BadInput(
        Concat("\"data_offsets\": expected an end of at most ", data_size, ", got ", offsets[1]));
  }
  const auto begin = static_cast<size_t>(offsets[0]), end = static_cast<size_t>(offsets[1]);
  if (ByteCount(tensor.shape, tensor.dtype) != end - begin) {
    throw BadInput(
        Concat("expected as many bytes as ", tensor.Describe(), " has, got ", end - begin));
  }
  return {std::move(tensor), begin, end - begin};
}

/// Throws BadInput unless the tensors cover the data without gaps and overlaps. The tensors then
/// take no more memory than the file.
void CheckCovered(const std::map<std::string, SafetensorsEntry>& entries, size_t data_size) {
  struct Piece {
    size_t begin, size;
    auto operator<=>(const Piece&) const = default;  // an empty piece is before one with its begin
  };
  std::vector<Piece> pieces;
  pieces.reserve(entries.size());
  for (const auto& [name, entry] : entries) pieces.push_back({entry.begin, entry.size});
  std::ranges::sort(pieces);
  size_t end = 0;
  for (const Piece& piece : pieces) {
    if (piece.size > 0 && piece.begin != end) {
      throw BadInput("expected tensors that do not overlap");
    }
    end += piece.size;
  }
  if (end != data_size) throw BadInput(Concat("expected ", end, " bytes of data, got ", data_size));
}

/// What a file is that begins with these bytes: a text, a pickle or an archive; empty if it is
/// unknown.
std::string OtherFormat(std::span<const std::byte> first_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(first_bytes.data()),
                              first_bytes.size());
  if (text.starts_with("PK\x03\x04")) return "a zip archive, which PyTorch and others write";
  if (text.starts_with("\x1f\x8b")) return "a gzip file";
  if (text.starts_with("\x80") && text[1] > 1 && text[1] < 6) return "a pickle of Python";
  const auto is_text = [](unsigned char c) {
    return c >= ' ' || c == '\t' || c == '\r' || c == '\n';
  };
  if (!std::ranges::all_of(text, is_text)) return "";
  return Concat("a text that begins with \"", Printable(text), "\"");
}

/// The text of a header, padded to whole words. Throws Failure if it is too long to load again or
/// is not UTF-8.
std::string HeaderText(const json& header) {
  try {
    std::string text = header.dump();
    text.resize((text.size() + 7) / 8 * 8, ' ');
    if (text.size() <= kMaxHeader) return text;
    throw Failure(Concat("cannot write tensors: expected names and metadata of at most ",
                         kMaxHeader, " bytes, got ", text.size()));
  } catch (const json::exception&) {
    throw Failure("cannot write tensors: expected metadata in UTF-8");
  }
}

/// Throws BadInput unless the text `header` holds the checksum of itself and `tensors`. The
/// checksum counts its own digits in the header as zeros.
void VerifyChecksum(std::string header, const std::map<std::string, Tensor>& tensors) {
  const size_t at = FindChecksum(header);
  if (at == std::string::npos) throw BadInput("checksum: expected it where Upswing writes it");
  const std::string expected = header.substr(at, kNoChecksum.size());
  header.replace(at, kNoChecksum.size(), kNoChecksum);
  Checksum checksum;
  checksum.Update(BytesOf(header));
  // Update the checksum tensor by tensor, as WriteSafetensors does, because zeros pad the last word
  // of each tensor.
  std::vector<const Tensor*> order;
  for (const auto& [name, tensor] : tensors) order.push_back(&tensor);
  std::ranges::sort(order, {}, [](const Tensor* tensor) { return tensor->bytes.data(); });
  for (const Tensor* tensor : order) checksum.Update(tensor->bytes);
  if (checksum.Hex() == expected) return;
  throw BadInput(
      Concat("damaged or modified: expected the checksum ", expected, ", got ", checksum.Hex()));
}

}  // namespace

Error BrokenSafetensors(const std::string& where, std::string_view why) {
  return BadInput(Concat(where, ": not a valid safetensors file: ", why));
}

uint64_t ReadSafetensorsLength(std::span<const std::byte> first_bytes, uint64_t file_size) {
  uint64_t length = 0;
  if (first_bytes.size() < sizeof(length))
    throw BadInput(Concat("expected at least 8 bytes, got ", file_size));
  std::memcpy(&length, first_bytes.data(), sizeof(length));
  if (length > kMaxHeader) {
    const std::string other = OtherFormat(first_bytes);
    throw BadInput(Concat("header length: expected at most ", kMaxHeader, ", got ",
                          other.empty() ? Concat(length) : other));
  }
  if (length > file_size - sizeof(length)) {
    throw BadInput(Concat("header: expected ", length, " bytes after the first ", sizeof(length),
                          ", got ", file_size - sizeof(length)));
  }
  return length;
}

SafetensorsHeader ReadSafetensorsHeader(std::string_view text, size_t data_size) {
  json object;
  try {
    object = ParseJsonObject(text);
  } catch (const Error& error) {
    throw BadInput(Concat("header: ", error.what()));
  }
  SafetensorsHeader header;
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

std::vector<std::byte> Safetensors::Joined() const {
  std::vector<std::byte> bytes = head;
  for (const auto body : bodies) bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

Safetensors WriteSafetensors(const Tensors& tensors) {
  // Put wide types first, so that each tensor is aligned to the size of its type.
  std::vector<std::pair<std::string, const Tensor*>> order;
  for (const auto& [name, tensor] : tensors.all()) order.emplace_back(name, &tensor);
  std::stable_sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
    return SizeOf(a.second->dtype) > SizeOf(b.second->dtype);
  });

  json header;
  header["__metadata__"] = tensors.metadata;
  header["__metadata__"]["checksum"] = kNoChecksum;
  size_t offset = 0;
  for (const auto& [name, tensor] : order) {
    const size_t end = offset + tensor->bytes.size();
    header[name] = {{"dtype", NameOf(tensor->dtype)},
                    {"shape", tensor->shape},
                    {"data_offsets", {offset, end}}};
    offset = end;
  }
  std::string text = HeaderText(header);

  // The checksum covers everything after the length. Its own digits count as zeros.
  Checksum checksum;
  checksum.Update(BytesOf(text));
  for (const auto& [name, tensor] : order) checksum.Update(tensor->bytes);
  text.replace(FindChecksum(text), kNoChecksum.size(), checksum.Hex());

  const uint64_t length = text.size();
  const auto length_bytes = std::as_bytes(std::span(&length, 1));
  Safetensors written;
  written.head.resize(length_bytes.size() + text.size());
  std::ranges::copy(BytesOf(text), std::ranges::copy(length_bytes, written.head.begin()).out);
  for (const auto& [name, tensor] : order) written.bodies.push_back(tensor->bytes);
  return written;
}

Tensors ReadSafetensors(std::vector<std::byte> content, std::string where) {
  Tensors tensors(std::move(where));
  const auto bytes = tensors.Keep(std::move(content));
  try {
    const uint64_t length = ReadSafetensorsLength(bytes, bytes.size());
    const std::string text(reinterpret_cast<const char*>(bytes.data()) + sizeof(length), length);
    const auto data = bytes.subspan(sizeof(length) + length);
    SafetensorsHeader header = ReadSafetensorsHeader(text, data.size());
    tensors.metadata = std::move(header.metadata);
    for (auto& [name, entry] : header.entries) {
      entry.tensor.bytes = data.subspan(entry.begin, entry.size);
      tensors.Add(name, std::move(entry.tensor));
    }
    tensors.has_checksum = tensors.metadata.contains("checksum");
    if (tensors.has_checksum) VerifyChecksum(text, tensors.all());
    if (!tensors.has_checksum && tensors.metadata.contains("upswing_version")) {
      throw BadInput("metadata \"checksum\": expected one, as in every file of Upswing, got none");
    }
  } catch (const Error& error) {
    throw BrokenSafetensors(tensors.where(), error.what());
  }
  tensors.metadata.erase("checksum");
  tensors.Widen();
  return tensors;
}

}  // namespace upswing
