// Mutates safetensors so that most of the parser still runs. Nearly all of libFuzzer's own
// mutations fail at the header's length or the checksum. A mutation changes one of these:
//   - any bytes of the file
//   - the header as text
//   - the text of one metadatum, or a number in it
//   - one number of a tensor
//   - one number of a tensor's shape, with matching data
//   - the presence or name of a tensor
// After all but the first, the header's length is correct, and so is the checksum if there is one.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "base/checksum.h"
#include "os/file.h"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace upswing {
namespace {

using nlohmann::json;
using Random = std::minstd_rand;

/// A tensor separated from its file.
struct LooseTensor {
  std::string name, dtype;
  std::vector<int64_t> shape;
  std::string data;
};

/// A file separated into its parts.
struct LooseFile {
  std::map<std::string, std::string> metadata;
  std::vector<LooseTensor> tensors;  // in the order of their data
};

size_t Below(Random& random, size_t count) { return random() % std::max<size_t>(1, count); }

/// An integer that parsers may handle wrongly.
int64_t OddInteger(Random& random) {
  constexpr auto kMost = std::numeric_limits<int64_t>::max();
  constexpr std::array<int64_t, 18> kIntegers{
      0,       1,     2,      3,    8,         -1,         100,       1 << 10,   1 << 16,
      1 << 24, kMost, -kMost, -100, 1LL << 31, -1LL << 31, 1LL << 32, 1LL << 40, 1LL << 62};
  return kIntegers.at(Below(random, kIntegers.size()));
}

double OddNumber(Random& random) {
  constexpr auto kInfinity = std::numeric_limits<double>::infinity();
  constexpr std::array<double, 12> kNumbers{0,     -0.0, 1,     -1,        0.5,        1e-300,
                                            1e-30, 1e30, 1e300, kInfinity, -kInfinity, NAN};
  return kNumbers.at(Below(random, kNumbers.size()));
}

/// Mutates bytes as libFuzzer does; the result has at most about twice the length.
void MutateBytes(std::string& text) {
  const size_t size = text.size();
  text.resize(2 * size + 16);
  text.resize(LLVMFuzzerMutate(reinterpret_cast<uint8_t*>(text.data()), size, text.size()));
}

/// Replaces a number by an odd one if there is one, else mutates bytes.
void MutateText(std::string& text, Random& random) {
  const size_t from = text.find_first_of("0123456789", Below(random, text.size()));
  if (from == std::string::npos || random() % 2 == 0) return MutateBytes(text);
  const size_t end = std::min(text.find_first_not_of("0123456789.e+-", from), text.size());
  const bool whole = random() % 2 == 0;
  text.replace(from, end - from,
               whole ? std::to_string(OddInteger(random)) : std::to_string(OddNumber(random)));
}

/// The integers of a list in a tensor's entry; none if there is no such list.
std::vector<int64_t> Integers(const json& entry, const char* name) {
  const json list = entry.is_object() ? entry.value(name, json()) : json();
  const auto is_integer = [](const json& item) { return item.is_number_integer(); };
  if (!list.is_array() || !std::ranges::all_of(list, is_integer)) return {};
  return list.get<std::vector<int64_t>>();
}

/// A file with this header. Sets the header's length, and its checksum if the header has one and it
/// can be computed.
std::string Seal(std::string header, const std::string& data) {
  constexpr std::string_view kKey = "\"checksum\":\"";
  const size_t at = header.find(kKey);
  const json object = json::parse(header, nullptr, false);
  if (at != std::string::npos && at + kKey.size() + 16 <= header.size() && object.is_object()) {
    const auto place = header.begin() + static_cast<ptrdiff_t>(at + kKey.size());
    std::fill_n(place, 16, '0');
    std::map<size_t, size_t> pieces;  // begin and end of each tensor
    for (const auto& [name, entry] : object.items()) {
      const std::vector<int64_t> offsets = Integers(entry, "data_offsets");
      if (offsets.size() == 2)
        pieces[static_cast<size_t>(offsets[0])] = static_cast<size_t>(offsets[1]);
    }
    Checksum checksum;
    checksum.Update(BytesOf(header));
    for (const auto& [begin, end] : pieces) {
      if (begin > end || end > data.size()) continue;
      checksum.Update(BytesOf(std::string_view(data).substr(begin, end - begin)));
    }
    std::ranges::copy(checksum.Hex(), place);
  }
  const uint64_t length = header.size();
  std::string file(sizeof(length), '\0');
  std::memcpy(file.data(), &length, sizeof(length));
  return file + header + data;
}

/// The header's text and the data after it; nothing if the length is not a header's.
std::optional<std::pair<std::string, std::string>> Split(std::string_view file) {
  uint64_t length = 0;
  if (file.size() < sizeof(length)) return std::nullopt;
  std::memcpy(&length, file.data(), sizeof(length));
  if (length > file.size() - sizeof(length)) return std::nullopt;
  return std::pair(std::string(file.substr(8, length)), std::string(file.substr(8 + length)));
}

/// Separates a file into its parts. Throws if it is not well-formed.
LooseFile TakeApart(const std::string& header, const std::string& data) {
  LooseFile file;
  std::map<size_t, LooseTensor> order;  // by beginning of their data; one of several empty ones
  const json object = json::parse(header);
  for (const auto& [name, entry] : object.items()) {
    if (name == "__metadata__") {
      file.metadata = entry.get<std::map<std::string, std::string>>();
      continue;
    }
    const std::vector<int64_t> offsets = Integers(entry, "data_offsets");
    const auto begin = static_cast<size_t>(offsets.at(0));
    order[begin] = {name, entry.at("dtype"), Integers(entry, "shape"),
                    data.substr(begin, static_cast<size_t>(offsets.at(1)) - begin)};
  }
  for (auto& [begin, tensor] : order) file.tensors.push_back(std::move(tensor));
  return file;
}

std::string PutTogether(const LooseFile& file) {
  json header;
  std::string data;
  header["__metadata__"] = file.metadata;
  for (const LooseTensor& tensor : file.tensors) {
    const size_t begin = data.size();
    data += tensor.data;
    header[tensor.name] = {
        {"dtype", tensor.dtype}, {"shape", tensor.shape}, {"data_offsets", {begin, data.size()}}};
  }
  return Seal(header.dump(-1, ' ', false, json::error_handler_t::replace), data);
}

size_t SizeOf(const LooseTensor& tensor) {
  if (tensor.dtype == "U8") return 1;
  return tensor.dtype == "F32" ? 4 : 8;
}

void MutateNumber(LooseTensor& tensor, Random& random) {
  const size_t size = SizeOf(tensor);
  if (tensor.data.size() < size) return;
  char* place = tensor.data.data() + Below(random, tensor.data.size() / size) * size;
  const int64_t integer = OddInteger(random);
  const double number = OddNumber(random);
  const auto single = static_cast<float>(number);
  std::memcpy(place, &integer, size);
  if (tensor.dtype == "F32") std::memcpy(place, &single, size);
  if (tensor.dtype == "F64") std::memcpy(place, &number, size);
}

void MutateShape(LooseTensor& tensor, Random& random) {
  if (tensor.shape.empty()) tensor.shape.push_back(1);
  int64_t& extent = tensor.shape[Below(random, tensor.shape.size())];
  const auto near =
      static_cast<int64_t>(static_cast<uint64_t>(extent) + random() % 3 - 1);  // may wrap
  extent = random() % 2 == 0 ? OddInteger(random) : near;
  size_t count = SizeOf(tensor);
  for (const int64_t n : tensor.shape) {
    if (n < 0 || n > 4096 || (count *= static_cast<size_t>(n)) > 65536) return;
  }
  tensor.data.resize(count);
}

void MutatePiece(LooseFile& file, Random& random) {
  if (random() % 3 == 0 && !file.metadata.empty()) {
    const auto metadatum = std::next(file.metadata.begin(),
                                     static_cast<ptrdiff_t>(Below(random, file.metadata.size())));
    return MutateText(metadatum->second, random);
  }
  if (file.tensors.empty()) return;
  const size_t which = Below(random, file.tensors.size());
  LooseTensor& tensor = file.tensors[which];
  switch (random() % 8) {
    case 0:
      return MutateShape(tensor, random);
    case 1:
      return MutateBytes(tensor.name);
    case 2:
      file.tensors.erase(file.tensors.begin() + static_cast<ptrdiff_t>(which));
      return;
    default:
      return MutateNumber(tensor, random);
  }
}

std::string Mutated(std::string file, Random& random) {
  auto pieces = Split(file);
  if (!pieces || random() % 16 == 0) {
    MutateBytes(file);
    return file;
  }
  auto& [header, data] = *pieces;
  if (random() % 8 == 0) {
    MutateText(header, random);
    return Seal(header, data);
  }
  try {
    LooseFile loose = TakeApart(header, data);
    for (size_t changes = 1 + random() % 2; changes > 0; --changes) MutatePiece(loose, random);
    return PutTogether(loose);
  } catch (const std::exception&) {  // an earlier mutation broke the file
    MutateText(header, random);
    return Seal(header, data);
  }
}

}  // namespace
}  // namespace upswing

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned int seed) {
  upswing::Random random(seed);
  const std::string file(reinterpret_cast<const char*>(data), size);
  const std::string mutated = upswing::Mutated(file, random);
  const size_t length = std::min(mutated.size(), max_size);
  std::memcpy(data, mutated.data(), length);
  return length;
}
