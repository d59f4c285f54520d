#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "setup/loaded_policy.h"

/// What `export` writes for programs in other languages.
namespace upswing {

/// The task's formulas as numbers, by which a reader in another language tests its own: a JSON
/// document of plants, states and what follows from them, the same with every call.
std::string TestVectorsJson();

/// Copies policies (files or run folders) into a page's folder of agents as ID.safetensors and
/// adds them to its agents.json, or replaces those of the same ID there. `id` names a single one;
/// empty: by its run's folder, else by its agent. With `checkpoints` (0: without) as many policies
/// along the way of each, from the untrained one to itself. Everything is read and checked before
/// anything is written. Returns the names of the files. Throws BadInput; Failure if the folder
/// cannot be written.
std::vector<std::string> ExportToPage(const std::vector<std::filesystem::path>& paths,
                                      const std::string& id, int64_t checkpoints,
                                      const std::filesystem::path& folder);

/// A learned policy as a file in ONNX's format: `observation` (batch × D) in; `torque` and, by
/// kind, `q_values`, `mean` and `log_std`, `probabilities`, `value` out; what they mean as metadata
/// (docs/howto/export.md). Throws BadInput if it is none that was learned.
std::string OnnxModelOf(const LoadedPolicy& loaded);

/// A learned policy, or a controller whose law is small, as a C99 header without dependencies
/// (docs/howto/export.md).
struct CHeader {
  std::string prefix;  // with which all of its names begin
  std::string text;
  size_t constant_bytes = 0;  // of flash
  size_t state_bytes = 0;     // of RAM, between calls
  size_t stack_bytes = 0;     // of RAM, in a call: its arrays
  size_t multiply_adds = 0;   // of a call, in the network's layers; 0 of a controller
};

/// `prefix`: small letters, digits and _, a letter first; see CPrefixOf. Throws BadInput if it is
/// something else, or if the policy is neither.
CHeader CHeaderOf(const LoadedPolicy& loaded, const std::string& prefix);

/// A prefix for the header of this name, such as "my_policy" for my-policy.h; of standard output
/// (-) from the policy's agent.
std::string CPrefixOf(const std::string& file, const LoadedPolicy& loaded);

}  // namespace upswing
