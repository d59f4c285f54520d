#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

/// JSON from files that may come from anybody, read strictly: nothing is rounded, wrapped around or
/// taken for another type. Each throws BadInput that says what was expected and what is there; who
/// knows the file puts its name in front.
namespace upswing {

/// An integer as JSON has it, neither 8.9 nor true; nothing if it is anything else.
std::optional<int64_t> JsonInteger(const nlohmann::json& value);

/// Parses an object of at most `max_depth` objects and lists inside one another.
nlohmann::json ParseJsonObject(std::string_view text, int max_depth = 3);

/// Members of an object, which must be there.
const nlohmann::json& JsonMember(const nlohmann::json& object, const std::string& name);
int64_t JsonInteger(const nlohmann::json& object, const std::string& name, int64_t low,
                    int64_t high);
double JsonNumber(const nlohmann::json& object, const std::string& name);
bool JsonBool(const nlohmann::json& object, const std::string& name);
const std::string& JsonText(const nlohmann::json& object, const std::string& name);
/// A list of at most `max_size` values.
const nlohmann::json& JsonList(const nlohmann::json& object, const std::string& name,
                               size_t max_size);

/// A document as the program prints it: indented, ASCII alone, U+FFFD for bytes that are not UTF-8.
std::string PrintableJson(const nlohmann::ordered_json& document);

}  // namespace upswing
