#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "agents/loaded_policy.h"

/// The exports of `export` for programs in other languages.
namespace upswing::deploy {

/// Copies policies (files or run folders) into a page's folder of agents as ID.safetensors. Adds
/// them to its agents.json, replacing entries with the same ID. `id` names a single policy; empty:
/// named by its run's folder, else by its agent. Each policy has `checkpoints` versions
/// in the page, from the untrained one to itself (0: only itself). Reads and checks everything
/// before it writes anything. Returns the names of the files. Throws BadInput; Failure if the
/// folder cannot be written.
std::vector<std::string> ExportToPage(const std::vector<std::string>& paths, const std::string& id,
                                      int64_t checkpoints, const std::filesystem::path& folder);

/// Parses a page's agents.json: {"agents": [{"id": …}, …]}. Throws BadInput that begins with
/// `where`.
nlohmann::ordered_json ParsePageIndex(std::string_view text, const std::string& where);

/// A learned policy as a file in ONNX's format. Input: `observation` (batch × D). Outputs: `torque`
/// and, by kind, `q_values`, `mean` and `log_std`, `probabilities`, `value`. Metadata explain them
/// (docs/howto/export.md). Throws BadInput if the policy was not learned.
std::string OnnxModelOf(const LoadedPolicy& loaded);

/// A learned policy, or a controller with a small law, as a C99 header without dependencies
/// (docs/howto/export.md).
struct CHeader {
  std::string prefix;  // of all its names
  std::string text;
  size_t constant_bytes = 0;  // in flash
  size_t state_bytes = 0;     // in RAM, between calls
  size_t stack_bytes = 0;     // in RAM, arrays of a call
  size_t multiply_adds = 0;   // per call, in the network's layers; 0 for a controller
};

/// Writes the C header. `prefix`: small letters, digits and _, beginning with a letter; see
/// CPrefixOf. Throws BadInput for another prefix, or for a policy that is neither learned nor such
/// a controller.
CHeader CHeaderOf(const LoadedPolicy& loaded, const std::string& prefix);

/// The prefix for a header file, such as "my_policy" for my-policy.h. For standard output (-), the
/// prefix comes from the policy's agent.
std::string CPrefixOf(const std::string& file, const LoadedPolicy& loaded);

}  // namespace upswing::deploy
