#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/finite.h"
#include "core/matrix.h"
#include "core/policy_info.h"
#include "core/tensors.h"
#include "core/text.h"
#include "nn/parameter_layout.h"

/// What the files of all learned policies have in common (docs/policy-format.md): the format, the
/// parameters of their networks, and sample inputs and outputs that every load recomputes.
namespace upswing {

inline constexpr int kPolicySamples = 16;  // stored inputs and outputs

/// Result of the checks on loading.
struct SelfCheck {
  bool has_checksum = false;  // a right one: no bit has changed
  double error = 0;           // largest |difference| of the samples' outputs when recomputed
  double tolerance = 0;       // largest error that counts as rounding
};

/// A file with the metadata of a policy whose actions are made as `output` says.
Tensors BeginPolicyFile(const PolicyInfo& info, std::string_view output);

/// What a file's metadata say of how actions are made. Throws BadInput unless the file is a policy
/// of this format.
const std::string& PolicyOutput(const Tensors& file);

/// Sample observations (kPolicySamples × D), the same for every policy: uniform in ±1.
std::vector<float> SampleObservations(int obs_size);

/// How many samples a file has: the rows of its tensor `name`. Throws BadInput.
int CountSamples(const Tensors& file, const std::string& name, int cols);

/// Throws BadInput unless all recomputed outputs are those of the tensor `name` (rows × cols) up to
/// rounding. `what` they are is for messages. Adds to `check`, whose has_checksum it sets.
void CheckSamples(const Tensors& file, const std::string& name, Matrix<const float> computed,
                  std::string_view what, SelfCheck& check);

/// Whether `torque` is the one of `torques` (Q) with the largest of the preferences (Q), or with
/// one that is at most `margin` below it.
bool MayChoose(std::span<const double> torques, double torque, std::span<const float> preferences,
               double margin);

/// Adds parameter arrays, with weights as torch.nn.Linear has them, (out × in), under names that
/// begin with `prefix`. Throws Failure if one is not finite.
void AddParameters(Tensors& file, const std::string& prefix,
                   const std::vector<ParameterBlock>& blocks, std::span<const float> parameters);
/// Throws BadInput unless the file has these arrays. To be called for all of a policy's networks
/// before any room is made, so that the file is as long as what it asks for.
void ExpectParameters(const Tensors& file, const std::string& prefix,
                      const std::vector<ParameterBlock>& blocks);
/// Reads what AddParameters added. Throws BadInput.
std::vector<float> ReadParameters(const Tensors& file, const std::string& prefix,
                                  const std::vector<ParameterBlock>& blocks);

/// A file's tensor of this shape, with finite numbers. Throws BadInput.
template <typename T>
std::vector<T> ReadFinite(const Tensors& file, const std::string& name,
                          const std::vector<int64_t>& shape) {
  file.Expect(name, kDtypeOf<T>, shape);
  std::vector<T> values(file.Count<T>(name));
  file.Read(name, std::span(values));
  const std::string problem = FindNotFinite<T>(values);
  if (problem.empty()) return values;
  throw BadInput(Concat(file.where(), ": tensor \"", name, "\": ", problem));
}

}  // namespace upswing
