#include "base/json.h"

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

using nlohmann::json;

Error Unexpected(std::string_view name, const std::string& expected, const json& got) {
  const std::string text = got.dump(-1, ' ', false, json::error_handler_t::replace);
  return BadInput(Concat("\"", name, "\": expected ", expected, ", got ", text));
}

/// The place of the quote that ends the string which begins at `at`; at least the text's size if
/// there is none.
size_t EndOfString(std::string_view text, size_t at) {
  ++at;
  while (at < text.size() && text[at] != '"') {
    const bool escapes = text[at] == '\\';
    at += escapes ? 2 : 1;
  }
  return at;
}

/// Throws BadInput for a text that is nested deeper than `max_depth` or has too many parts. The
/// parser and the destructor of its result take stack for each level and memory for each part.
void CheckSize(std::string_view text, int max_depth) {
  constexpr int kMostParts = 1'000'000;  // a part of 3 bytes can take 80 bytes of memory
  int depth = 0;
  int parts = 0;
  for (size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == ']' || c == '}') --depth;
    if (std::string_view(" \t\r\n]},:").find(c) != std::string_view::npos) continue;
    if (depth > max_depth) {
      throw BadInput(Concat("expected JSON at most ", max_depth, " levels deep"));
    }
    if (++parts > kMostParts) {
      throw BadInput(Concat("expected JSON of at most ", kMostParts, " names, values and lists"));
    }
    if (c == '[' || c == '{') {
      ++depth;
    } else if (c == '"') {
      at = EndOfString(text, at);
    } else {
      at = std::min(text.find_first_of(" \t\r\n]},:[{\"", at), text.size()) - 1;
    }
  }
}

}  // namespace

std::optional<int64_t> JsonInteger(const json& value) {
  if (!value.is_number_integer()) return std::nullopt;
  const bool too_large =
      value.is_number_unsigned() &&
      value.get<uint64_t>() > static_cast<uint64_t>(std::numeric_limits<int64_t>::max());
  if (too_large) return std::nullopt;
  return value.get<int64_t>();
}

json ParseJsonObject(std::string_view text, int max_depth) {
  CheckSize(text, max_depth);
  // The parser's own message could quote bytes that are not text.
  json object = json::parse(text, nullptr, false);
  if (!object.is_object()) throw BadInput("expected a JSON object");
  return object;
}

const json& JsonMember(const json& object, std::string_view name) {
  const auto found = object.find(name);
  if (found == object.end()) throw BadInput(Concat("expected \"", name, "\", found none"));
  return *found;
}

int64_t JsonInteger(const json& object, std::string_view name, int64_t low, int64_t high) {
  const json& member = JsonMember(object, name);
  const std::optional<int64_t> value = JsonInteger(member);
  if (value && *value >= low && *value <= high) return *value;
  throw Unexpected(name, Concat("an integer in [", low, ", ", high, "]"), member);
}

double JsonNumber(const json& object, std::string_view name) {
  const json& member = JsonMember(object, name);
  if (!member.is_number()) throw Unexpected(name, "a number", member);
  return member.get<double>();
}

bool JsonBool(const json& object, std::string_view name) {
  const json& member = JsonMember(object, name);
  if (!member.is_boolean()) throw Unexpected(name, "true or false", member);
  return member.get<bool>();
}

const std::string& JsonText(const json& object, std::string_view name) {
  const json& member = JsonMember(object, name);
  if (!member.is_string()) throw Unexpected(name, "a text", member);
  return member.get_ref<const std::string&>();
}

const json& JsonList(const json& object, std::string_view name, size_t max_size) {
  const json& member = JsonMember(object, name);
  if (member.is_array() && member.size() <= max_size) return member;
  throw Unexpected(name, Concat("a list of at most ", max_size), member);
}

std::string PrintableJson(const nlohmann::ordered_json& document) {
  return document.dump(2, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace upswing
