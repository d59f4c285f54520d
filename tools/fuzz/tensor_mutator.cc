// Mutates safetensors so that most of the parser still runs: nearly all of libFuzzer's own
// mutations fail at the header's length or the checksum. Most mutations change the text of one
// metadatum, or a tensor's numbers, shape, name or presence, and have a correct length and
// checksum. The others change any bytes of the header or of the file.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <string>

#include "base/error.h"
#include "base/safetensors.h"
#include "os/file.h"
#include "tools/fuzz/target.h"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace upswing {
namespace {

using Random = std::minstd_rand;

size_t Below(Random& random, size_t count) { return random() % std::max<size_t>(1, count); }

/// A number that parsers may handle wrongly.
double OddNumber(Random& random) {
  constexpr auto kInfinity = std::numeric_limits<double>::infinity();
  constexpr std::array<double, 18> kNumbers{0,     -0.0,  1,          -1,    0.5,       3,
                                            100,   65536, 4294967296, 1e30,  1e15,      9e18,
                                            -9e18, 1e300, 1e-300,     1e-30, kInfinity, NAN};
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
  std::string number = std::to_string(OddNumber(random));
  if (random() % 2 == 0) number.resize(std::min(number.find('.'), number.size()));  // an integer
  text.replace(from, end - from, number);
}

/// A copy of a tensor with one number, or with one number of its shape and matching data, changed.
Tensor Changed(Tensor tensor, Tensors& owner, Random& random) {
  std::vector<std::byte> bytes(tensor.bytes.begin(), tensor.bytes.end());
  const size_t size = SizeOf(tensor.dtype);
  if (random() % 6 == 0) {
    if (tensor.shape.empty()) tensor.shape.push_back(1);
    int64_t& extent = tensor.shape[Below(random, tensor.shape.size())];
    extent = std::max<int64_t>(0, extent + static_cast<int64_t>(random() % 3) - 1);
    size_t count = size;
    for (const int64_t n : tensor.shape) count *= static_cast<size_t>(n);
    bytes.resize(count);
  } else if (bytes.size() >= size) {
    const double number = OddNumber(random);
    const auto single = static_cast<float>(number);
    const auto integer = static_cast<int64_t>(random());
    std::byte* place = bytes.data() + Below(random, bytes.size() / size) * size;
    if (tensor.dtype == Dtype::kF64) {
      std::memcpy(place, &number, size);
    } else if (tensor.dtype == Dtype::kF32) {
      std::memcpy(place, &single, size);
    } else {
      std::memcpy(place, &integer, size);
    }
  }
  tensor.bytes = owner.Keep(std::move(bytes));
  return tensor;
}

/// A well-formed file with one changed metadatum or tensor. Throws Error.
std::string WithChangedPart(const std::string& file, Random& random) {
  const auto content = BytesOf(file);
  Tensors tensors = ReadSafetensors({content.begin(), content.end()}, kInputName);
  Tensors result;
  result.metadata = tensors.metadata;
  const bool in_text = random() % 3 == 0;
  size_t which = Below(random, in_text ? result.metadata.size() : tensors.all().size());
  for (auto& [name, text] : result.metadata) {
    if (in_text && which-- == 0) MutateText(text, random);
  }
  for (const auto& [name, tensor] : tensors.all()) {
    std::string new_name = name;
    Tensor new_tensor = tensor;
    if (!in_text && which-- == 0) {
      const auto choice = random() % 8;
      if (choice == 0) continue;  // left out
      if (choice == 1) MutateBytes(new_name);
      if (choice > 1) new_tensor = Changed(tensor, result, random);
    }
    result.Add(new_name, std::move(new_tensor));
  }
  const std::vector<std::byte> bytes = WriteSafetensors(result).Joined();
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A file with a mutated header of correct length, or with any mutated bytes.
std::string WithChangedBytes(std::string file, Random& random) {
  uint64_t length = 0;
  constexpr size_t kSize = sizeof(length);
  if (file.size() > kSize) std::memcpy(&length, file.data(), kSize);
  if (length == 0 || length > file.size() - kSize || random() % 2 == 0) {
    MutateBytes(file);
    return file;
  }
  std::string header = file.substr(kSize, length);
  MutateText(header, random);
  const std::string data = file.substr(kSize + length);
  length = header.size();
  std::memcpy(file.data(), &length, kSize);
  return file.substr(0, kSize) + header + data;
}

std::string Mutated(const std::string& file, Random& random) {
  if (random() % 8 == 0) return WithChangedBytes(file, random);
  try {
    return WithChangedPart(file, random);
  } catch (const Error&) {  // an earlier mutation broke the file, or this one cannot be written
    return WithChangedBytes(file, random);
  }
}

}  // namespace
}  // namespace upswing

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size,
                                          unsigned int seed) {
  upswing::Random random(seed);
  const std::string mutated = upswing::Mutated({reinterpret_cast<const char*>(data), size}, random);
  const size_t length = std::min(mutated.size(), max_size);
  std::memcpy(data, mutated.data(), length);
  return length;
}
