#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

/// JSON from untrusted files, read strictly: nothing is rounded, wrapped around or converted from
/// another type. Each function throws BadInput that says what was expected and what was found; the
/// caller, who knows the file, adds its name.
namespace upswing {

/// The value of a JSON integer (not 8.9, not true) that fits; nothing if it is anything else.
std::optional<int64_t> JsonInteger(const nlohmann::json& value);

/// Parses an object in which objects and lists are nested at most `max_depth` deep.
nlohmann::json ParseJsonObject(std::string_view text, int max_depth = 3);

/// Members of an object that must exist; integers are in [low, high].
const nlohmann::json& JsonMember(const nlohmann::json& object, std::string_view name);
int64_t JsonInteger(const nlohmann::json& object, std::string_view name, int64_t low, int64_t high);
double JsonNumber(const nlohmann::json& object, std::string_view name);
bool JsonBool(const nlohmann::json& object, std::string_view name);
const std::string& JsonText(const nlohmann::json& object, std::string_view name);
/// A list of at most `max_size` values.
const nlohmann::json& JsonList(const nlohmann::json& object, std::string_view name,
                               size_t max_size);

/// A document as the program prints it: indented, ASCII alone, U+FFFD for bytes that are not UTF-8.
std::string PrintableJson(const nlohmann::ordered_json& document);

}  // namespace upswing
