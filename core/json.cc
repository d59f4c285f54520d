#include "core/json.h"

#include <limits>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

using nlohmann::json;

Error Unexpected(std::string_view name, const std::string& expected, const json& got) {
  const std::string text = got.dump(-1, ' ', false, json::error_handler_t::replace);
  return BadInput(Concat("\"", name, "\": expected ", expected, ", got ", text));
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
  constexpr int kMostParts = 1'000'000;  // a part of 3 bytes can take 80 bytes of memory
  bool too_deep = false;
  int parts = 0;
  const auto keep = [&](int depth, json::parse_event_t, const json&) {
    too_deep |= depth > max_depth;
    if (parts <= kMostParts) ++parts;
    // The parser allocates nothing for a value that is not kept.
    return !too_deep && parts <= kMostParts;
  };
  // The parser's own message could quote bytes that are not text.
  json object = json::parse(text, keep, false);
  if (too_deep) throw BadInput(Concat("expected JSON at most ", max_depth, " levels deep"));
  if (parts > kMostParts) {
    throw BadInput(Concat("expected JSON of at most ", kMostParts, " names, values and brackets"));
  }
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
