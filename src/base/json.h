#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

/// Strict readers of JSON from untrusted files. They do not round, wrap around or convert types.
/// Each function throws BadInput with the expected and the found value. The caller adds the name of
/// the file.
namespace upswing {

/// The value of a JSON integer that fits in int64_t; nothing for any other value, such as 8.9 or
/// true.
std::optional<int64_t> JsonInteger(const nlohmann::json& value);

/// Parses a JSON object whose objects and lists are nested at most `max_depth` levels deep, and
/// which has at most a million names, values and brackets.
nlohmann::json ParseJsonObject(std::string_view text, int max_depth = 3);

/// Reads a member that must exist in an object. Integers must be in [low, high].
const nlohmann::json& JsonMember(const nlohmann::json& object, std::string_view name);
int64_t JsonInteger(const nlohmann::json& object, std::string_view name, int64_t low, int64_t high);
double JsonNumber(const nlohmann::json& object, std::string_view name);
bool JsonBool(const nlohmann::json& object, std::string_view name);
const std::string& JsonText(const nlohmann::json& object, std::string_view name);
/// Reads a list of at most `max_size` values.
const nlohmann::json& JsonList(const nlohmann::json& object, std::string_view name,
                               size_t max_size);

/// Prints a document: indented and in ASCII, with U+FFFD for bytes that are not UTF-8.
std::string PrintableJson(const nlohmann::ordered_json& document);

}  // namespace upswing
