#include "nn/policy_file.h"

#include <algorithm>
#include <cmath>

#include "core/argmax.h"
#include "core/rng.h"
#include "nn/linear.h"

namespace upswing {
namespace {

constexpr std::string_view kFormat = "upswing-policy";
constexpr std::string_view kFormatVersion = "1";
constexpr int64_t kMostSamples = 64;  // that a file of another writer may have

// Up to which share of the largest output two machines may differ, which sum in other orders. The
// vector paths (AVX-512, AVX2, portable) differ among each other by at most 3e-7 for the networks
// that come with the page and by 1.1e-6 for random ones of up to 16 layers or 4096 units; single
// from double precision by 4e-7 and 2.3e-6.
constexpr double kTolerance = 1e-5;

/// The shape of a parameter array in the file.
std::vector<int64_t> FileShape(const ParameterBlock& block) {
  if (block.in == 0) return {block.out};
  return {block.out, block.in};
}

}  // namespace

Tensors BeginPolicyFile(const PolicyInfo& info, std::string_view output) {
  Tensors file;
  file.metadata = PolicyMetadata(info);
  file.metadata["format"] = kFormat;
  file.metadata["format_version"] = std::string(kFormatVersion);
  file.metadata["output"] = output;
  return file;
}

const std::string& PolicyOutput(const Tensors& file) {
  const auto expect = [&](const std::string& key, std::string_view expected) {
    if (file.Metadata(key) != expected) {
      throw BadInput(Concat(file.where(), ": ", key, ": expected \"", expected, "\", got \"",
                            file.Metadata(key), "\""));
    }
  };
  expect("format", kFormat);
  expect("format_version", kFormatVersion);
  return file.Metadata("output");
}

std::vector<float> SampleObservations(int obs_size) {
  Rng rng(0, "policy self-check");
  std::vector<float> obs(static_cast<size_t>(kPolicySamples) * static_cast<size_t>(obs_size));
  for (float& x : obs) x = static_cast<float>(rng.Uniform(-1, 1));
  return obs;
}

int CountSamples(const Tensors& file, const std::string& name, int cols) {
  const auto numbers = static_cast<int64_t>(file.Count<double>(name));
  const int64_t samples = numbers / cols;
  if (samples >= 1 && samples <= kMostSamples && numbers % cols == 0) {
    return static_cast<int>(samples);
  }
  throw BadInput(Concat(file.where(), ": tensor \"", name, "\": expected 1 to ", kMostSamples,
                        " samples to check, got ", samples));
}

void CheckSamples(const Tensors& file, const std::string& name, Matrix<const float> computed,
                  std::string_view what, SelfCheck& check) {
  const std::vector<float> expected =
      ReadFinite<float>(file, name, {computed.rows(), computed.cols()});
  double largest = 0;
  for (const float x : expected) largest = std::max(largest, std::abs(double{x}));
  const double tolerance = kTolerance * largest;
  check.has_checksum = file.has_checksum;
  check.tolerance = std::max(check.tolerance, tolerance);
  for (size_t i = 0; i < expected.size(); ++i) {
    const float got = computed.values()[i];
    const double error = std::abs(double{got} - expected[i]);
    if (!(error <= tolerance)) {  // nor if it is not a number
      throw BadInput(Concat(file.where(), ": self-check: expected ", what, " ", expected[i],
                            " up to ", tolerance, ", got ", got, " (sample ",
                            i / static_cast<size_t>(computed.cols()), ")"));
    }
    check.error = std::max(check.error, error);
  }
}

bool MayChoose(std::span<const double> torques, double torque, std::span<const float> preferences,
               double margin) {
  const double best = preferences[static_cast<size_t>(ArgMax(preferences))];
  for (size_t i = 0; i < torques.size(); ++i) {
    if (torques[i] == torque && best - preferences[i] <= margin) return true;
  }
  return false;
}

void AddParameters(Tensors& file, const std::string& prefix,
                   const std::vector<ParameterBlock>& blocks, std::span<const float> parameters) {
  const std::string problem = FindNotFinite<float>(parameters);
  if (!problem.empty()) throw Failure(Concat("policy parameters: ", problem));
  std::vector<float> array;
  for (const ParameterBlock& block : blocks) {
    const Matrix<const float> values(parameters.data() + block.offset, std::max(1, block.in),
                                     block.out);
    array.resize(block.size());
    Transpose(values, Matrix<float>(array, values.cols(), values.rows()));
    file.AddCopy<float>(prefix + block.name, array, FileShape(block));
  }
}

void ExpectParameters(const Tensors& file, const std::string& prefix,
                      const std::vector<ParameterBlock>& blocks) {
  for (const ParameterBlock& block : blocks) {
    file.Expect(prefix + block.name, Dtype::kF32, FileShape(block));
  }
}

std::vector<float> ReadParameters(const Tensors& file, const std::string& prefix,
                                  const std::vector<ParameterBlock>& blocks) {
  std::vector<float> parameters(blocks.back().offset + blocks.back().size());
  for (const ParameterBlock& block : blocks) {
    const std::vector<float> array = ReadFinite<float>(file, prefix + block.name, FileShape(block));
    const Matrix<float> values(parameters.data() + block.offset, std::max(1, block.in), block.out);
    Transpose(Matrix<const float>(array, values.cols(), values.rows()), values);
  }
  return parameters;
}

}  // namespace upswing
