#include "core/tensors.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

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

}  // namespace

std::string_view NameOf(Dtype dtype) { return FactsOf(dtype).name; }
size_t SizeOf(Dtype dtype) { return FactsOf(dtype).size; }

std::optional<Dtype> DtypeCalled(std::string_view name) {
  const auto facts = std::ranges::find(kDtypes, name, &DtypeFacts::name);
  if (facts == kDtypes.end()) return std::nullopt;
  return facts->dtype;
}

std::string Tensor::Describe() const {
  std::vector<std::string> extents;
  for (const int64_t extent : shape) extents.push_back(std::to_string(extent));
  return Concat(NameOf(dtype), " [", Join(extents, ", "), "]");
}

const std::string& Tensors::Metadata(const std::string& key) const {
  const auto found = metadata.find(key);
  if (found == metadata.end()) throw BadInput(Concat(where_, ": no metadata \"", key, "\""));
  return found->second;
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
