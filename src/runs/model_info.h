#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace upswing {

/// Description of a model that is not built in, for every report of results.
struct ModelInfo {
  std::string file;     // path as the user gave it; empty: the model came with the policy
  std::string content;  // checksum of its text, 16 hexadecimal digits
  std::vector<std::string> differences;  // output of DifferencesFromBuiltIn

  /// Caption such as "FILE, not the built-in one (content 0123456789abcdef)".
  std::string Caption() const;
  /// Caption with the differences.
  std::string Text() const;
  /// The three members as a JSON object.
  nlohmann::ordered_json Json() const;
};

/// Describes a model; nothing for the built-in model (`mjcf` is empty). Throws BadInput if it is
/// not a double pendulum that the program can use.
std::optional<ModelInfo> InfoOfModel(const std::string& mjcf, const std::string& file);

/// A title, followed by the model's caption if there is one.
std::string WithModel(const std::string& title, const std::optional<ModelInfo>& model);

/// Result of ModelContent for the built-in model.
inline constexpr const char* kBuiltIn = "built-in";

/// Checksum of a model, or kBuiltIn. It distinguishes models in a table.
std::string ModelContent(const std::string& mjcf);

}  // namespace upswing
