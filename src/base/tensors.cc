#include "base/tensors.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

struct DtypeFacts {
  Dtype dtype;
  std::string_view name;
  size_t size;
};
constexpr std::array kDtypes{
    DtypeFacts{Dtype::kU8, "U8", 1},   DtypeFacts{Dtype::kBF16, "BF16", 2},
    DtypeFacts{Dtype::kF32, "F32", 4}, DtypeFacts{Dtype::kF64, "F64", 8},
    DtypeFacts{Dtype::kI64, "I64", 8}, DtypeFacts{Dtype::kU64, "U64", 8},
};

const DtypeFacts& FactsOf(Dtype dtype) {
  return *std::ranges::find(kDtypes, dtype, &DtypeFacts::dtype);
}

/// The numbers of a tensor. Its bytes need not be aligned.
template <typename T>
std::vector<T> NumbersOf(const Tensor& tensor) {
  std::vector<T> numbers(tensor.bytes.size() / sizeof(T));
  if (!numbers.empty()) std::memcpy(numbers.data(), tensor.bytes.data(), tensor.bytes.size());
  return numbers;
}

template <typename T>
std::vector<std::byte> BytesOfNumbers(const std::vector<T>& numbers) {
  const auto bytes = std::as_bytes(std::span(numbers));
  return {bytes.begin(), bytes.end()};
}

}  // namespace

std::string_view NameOf(Dtype dtype) { return FactsOf(dtype).name; }
size_t SizeOf(Dtype dtype) { return FactsOf(dtype).size; }

std::optional<Dtype> DtypeCalled(std::string_view name) {
  const auto facts = std::ranges::find(kDtypes, name, &DtypeFacts::name);
  if (facts == kDtypes.end()) return std::nullopt;
  return facts->dtype;
}

std::string Tensor::Describe() const { return Concat(NameOf(dtype), " [", Join(shape, ", "), "]"); }

const std::string& Tensors::Metadata(const std::string& key) const {
  const auto found = metadata.find(key);
  if (found == metadata.end()) throw BadInput(Concat(where_, ": no metadata \"", key, "\""));
  return found->second;
}

void Tensors::ExpectMetadata(const std::string& key, std::string_view expected) const {
  const std::string& got = Metadata(key);
  if (got == expected) return;
  throw BadInput(Concat(where_, ": ", key, ": expected \"", expected, "\", got \"", got, "\""));
}

void Tensors::Narrow() {
  for (auto& [name, tensor] : tensors_) {
    if (tensor.dtype != Dtype::kF32) continue;
    const std::vector<uint32_t> wide = NumbersOf<uint32_t>(tensor);
    if (std::ranges::any_of(wide, [](uint32_t bits) { return (bits & 0xffff) != 0; })) continue;
    std::vector<uint16_t> narrow(wide.size());
    std::ranges::transform(wide, narrow.begin(), [](uint32_t bits) { return bits >> 16; });
    tensor = {Dtype::kBF16, tensor.shape, Keep(BytesOfNumbers(narrow))};
  }
}

void Tensors::Widen() {
  for (auto& [name, tensor] : tensors_) {
    if (tensor.dtype != Dtype::kBF16) continue;
    const std::vector<uint16_t> narrow = NumbersOf<uint16_t>(tensor);
    std::vector<uint32_t> wide(narrow.size());
    std::ranges::transform(narrow, wide.begin(), [](uint32_t bits) { return bits << 16; });
    tensor = {Dtype::kF32, tensor.shape, Keep(BytesOfNumbers(wide))};
  }
}

void Tensors::Expect(const std::string& name, Dtype dtype,
                     const std::vector<int64_t>& shape) const {
  const Tensor& tensor = Find(name, dtype);
  if (tensor.shape == shape) return;
  const Tensor expected{dtype, shape, {}};
  throw BadInput(Concat(where_, ": tensor \"", name, "\": expected ", expected.Describe(), ", got ",
                        tensor.Describe()));
}

const Tensor& Tensors::Find(const std::string& name, Dtype dtype) const {
  const auto found = tensors_.find(name);
  if (found == tensors_.end()) throw BadInput(Concat(where_, ": no tensor \"", name, "\""));
  if (found->second.dtype != dtype) {
    throw BadInput(Concat(where_, ": tensor \"", name, "\": expected ", NameOf(dtype), ", got ",
                          found->second.Describe()));
  }
  return found->second;
}

void Tensors::ReadBytes(const std::string& name, Dtype dtype, const std::vector<int64_t>& shape,
                        std::span<std::byte> bytes) const {
  if (!shape.empty()) Expect(name, dtype, shape);
  const Tensor& tensor = Find(name, dtype);
  if (tensor.bytes.size() != bytes.size()) {
    throw BadInput(Concat(where_, ": tensor \"", name, "\": expected ",
                          bytes.size() / SizeOf(dtype), " numbers, got ", tensor.Describe()));
  }
  if (!bytes.empty()) std::memcpy(bytes.data(), tensor.bytes.data(), bytes.size());
}

}  // namespace upswing
