#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace upswing {

/// What every report of results says of a model that is not the built-in one.
struct ModelInfo {
  std::string file;                      // as it was given; empty: it came with the policy
  std::string content;                   // checksum of its text, 16 hexadecimal digits
  std::vector<std::string> differences;  // as DifferencesFromBuiltIn has them

  /// "FILE, not the built-in one (content 0123456789abcdef)".
  std::string Caption() const;
  /// The same with the differences.
  std::string Text() const;
  /// The three as an object.
  nlohmann::ordered_json Json() const;
};

/// Nothing for the built-in model (`mjcf` is empty). Throws BadInput if it is no double pendulum
/// that the program can use.
std::optional<ModelInfo> InfoOfModel(const std::string& mjcf, const std::string& file);

/// A title with the model's caption behind it, where there is one.
std::string WithModel(const std::string& title, const std::optional<ModelInfo>& model);

/// What ModelContent says of the built-in model.
inline constexpr const char* kBuiltIn = "built-in";

/// The model's checksum, or kBuiltIn: distinguishes models in a table.
std::string ModelContent(const std::string& mjcf);

}  // namespace upswing
