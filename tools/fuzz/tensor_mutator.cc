// Mutates safetensors so that most of the parser still runs: nearly all of libFuzzer's own
// mutations fail at the header's length or the checksum. Most mutations change one metadatum, or a
// tensor's numbers, shape or presence, and have a correct length and checksum.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/safetensors.h"
#include "tools/fuzz/target.h"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace upswing {
namespace {

/// Bytes as libFuzzer mutates them, at most `more` longer.
template <typename Bytes>
Bytes Mutated(Bytes bytes, size_t more) {
  const size_t size = bytes.size();
  bytes.resize(size + more);
  bytes.resize(LLVMFuzzerMutate(reinterpret_cast<uint8_t*>(bytes.data()), size, bytes.size()));
  return bytes;
}

/// A well-formed file with one changed metadatum or tensor. Throws Error.
std::vector<std::byte> WithChangedPart(std::vector<std::byte> file, std::minstd_rand& random) {
  const Tensors tensors = ReadSafetensors(std::move(file), kInputName);
  Tensors result;
  result.metadata = tensors.metadata;
  size_t which = random() % std::max<size_t>(1, tensors.metadata.size() + tensors.all().size());
  for (auto& [name, text] : result.metadata) {
    if (which-- == 0) text = Mutated(text, text.size() + 16);
  }
  for (const auto& [name, tensor] : tensors.all()) {
    Tensor changed = tensor;
    if (which-- == 0) {
      if (random() % 8 == 0) continue;  // left out
      std::vector<std::byte> bytes(tensor.bytes.begin(), tensor.bytes.end());
      const size_t size = bytes.size();
      bytes = Mutated(std::move(bytes), SizeOf(tensor.dtype));
      if (random() % 4 == 0) {
        bytes.resize(bytes.size() / SizeOf(tensor.dtype) * SizeOf(tensor.dtype));
        changed.shape = {static_cast<int64_t>(bytes.size() / SizeOf(tensor.dtype))};
      } else {
        bytes.resize(size);
      }
      changed.bytes = result.Keep(std::move(bytes));
    }
    result.Add(name, std::move(changed));
  }
  return WriteSafetensors(result).Joined();
}

}  // namespace
}  // namespace upswing

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned int seed) {
  std::minstd_rand random(seed);
  const auto* bytes = reinterpret_cast<const std::byte*>(data);
  try {
    if (random() % 8 == 0) return LLVMFuzzerMutate(data, size, max_size);
    const auto mutated = upswing::WithChangedPart({bytes, bytes + size}, random);
    if (mutated.size() > max_size) return size;
    std::memcpy(data, mutated.data(), mutated.size());
    return mutated.size();
  } catch (const upswing::Error&) {  // an earlier mutation broke the file
    return LLVMFuzzerMutate(data, size, max_size);
  }
}
