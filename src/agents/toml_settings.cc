#include "agents/toml_settings.h"

#include <algorithm>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

/// What a file has where a number or another type is expected. Quotes make a text of a number.
std::string WrongTypeOf(const toml::node& node) {
  const std::optional<std::string> text = TextOf(node);
  if (!text) return "another type";
  return Concat(node.is_string() ? "the text " : "", "\"", *text, "\"");
}

/// Sets one key of a section, or a key without a section if `section` is empty.
FlagValue ApplyNode(const Options& options, const std::string& section, const std::string& key,
                    const toml::node& node, const std::string& where) {
  const std::string place = PlaceOf(node, where);
  const std::string scope = section.empty() ? place : Concat(place, ": [", section, "]");
  const FlagValue setting{key, TextOf(node).value_or(""), Concat(place, ": ", key)};
  for (const Option* option : options.Find(key, scope)) {
    if (!section.empty() && option->section != section) {
      throw BadInput(Concat(setting.where, ": expected in section [", option->section,
                            "], got in [", section, "]"));
    }
    const bool wants_text = std::holds_alternative<std::string*>(option->target);
    if (!TextOf(node) || node.is_string() != wants_text) {
      throw BadInput(
          Concat(setting.where, ": expected ", option->expected(), ", got ", WrongTypeOf(node)));
    }
    option->Set(setting.text, setting.where);
  }
  return setting;
}

constexpr size_t kMostBytes = 1 << 20;
constexpr int kMostDepth = 16;  // levels of lists and tables, and parts of a dotted key

/// The end of the string whose first quote is at `at`; npos if it is not closed.
size_t EndOfString(std::string_view text, size_t at) {
  const std::string quote(1, text[at]), three(3, text[at]);
  const bool is_long = text.substr(at).starts_with(three);
  for (at += is_long ? 3 : 1; at < text.size(); ++at) {
    const std::string_view rest = text.substr(at);
    if (quote == "\"" && rest.starts_with('\\')) {
      ++at;
    } else if (is_long && rest.starts_with(three)) {
      // One or two quotes before the last three belong to the string.
      return at + std::clamp<size_t>(rest.find_first_not_of(quote), 3, 5);
    } else if (!is_long && rest.starts_with(quote)) {
      return at + 1;
    } else if (!is_long && rest.starts_with('\n')) {
      break;
    }
  }
  return std::string_view::npos;
}

/// Throws BadInput if lists, tables or dotted keys of a document are nested deeper than kMostDepth.
/// The parser and the destructors of its result call themselves for each level, which could
/// overflow the stack. Ignores the text after a string that is not closed, as the parser does.
void CheckDepth(std::string_view text, const std::string& where) {
  int depth = 0, parts = 1;
  for (size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == '"' || c == '\'') {
      at = EndOfString(text, at) - 1;
      if (at >= text.size()) return;
    } else if (c == '#') {
      at = std::min(text.find('\n', at), text.size());
    }
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (c == '.') ++parts;
    if (std::string_view("[]{},=#\n").find(c) != std::string_view::npos) parts = 1;
    if (depth <= kMostDepth && parts <= kMostDepth) continue;
    throw BadInput(Concat(where, ":", 1 + std::ranges::count(text.substr(0, at), '\n'),
                          ": expected lists, tables and dotted keys of at most ", kMostDepth,
                          " levels, got more"));
  }
}

}  // namespace

toml::table ParseToml(std::string_view text, const std::string& where) {
  if (text.size() > kMostBytes) {
    throw BadInput(
        Concat(where, ": expected TOML of at most ", kMostBytes, " bytes, got ", text.size()));
  }
  CheckDepth(text, where);
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw BadInput(Concat(where, ":", error.source().begin.line, ": ", error.description()));
  }
}

std::string PlaceOf(const toml::node& node, const std::string& where) {
  return Concat(where, ":", node.source().begin.line);
}

std::optional<std::string> TextOf(const toml::node& node) {
  if (const auto* value = node.as_boolean()) return value->get() ? "true" : "false";
  if (const auto* value = node.as_integer()) return std::to_string(value->get());
  if (const auto* value = node.as_floating_point()) return FormatNumber(value->get());
  if (const auto* value = node.as_string()) return value->get();
  const auto* array = node.as_array();
  if (array == nullptr) return std::nullopt;
  std::vector<std::string> items;
  for (const toml::node& item : *array) {
    if (!item.is_integer()) return std::nullopt;
    items.push_back(std::to_string(item.as_integer()->get()));
  }
  return Concat("[", Join(items, ", "), "]");
}

std::string TakeText(toml::table& table, std::string_view key, const std::string& where) {
  const toml::node* node = table.get(key);
  if (node == nullptr) return {};
  if (!node->is_string()) {
    throw BadInput(Concat(PlaceOf(*node, where), ": ", key, ": expected a text, got another type"));
  }
  std::string text = node->as_string()->get();
  table.erase(key);
  return text;
}

std::vector<std::string> TakeUnknown(const Options& options, toml::table& table) {
  std::vector<std::string> unknown;
  toml::table known;
  for (const auto& [section, node] : table) {
    const auto* settings = node.as_table();
    if (settings == nullptr) {
      unknown.emplace_back(section.str());
      continue;
    }
    toml::table known_settings;
    for (const auto& [key, value] : *settings) {
      const Option* option = options.Get(key.str());
      if (option != nullptr && option->section == section.str()) {
        known_settings.insert(key, value);
      } else {
        unknown.push_back(Concat(section.str(), ".", key.str()));
      }
    }
    if (!known_settings.empty()) known.insert(section, known_settings);
  }
  table = std::move(known);
  return unknown;
}

std::vector<FlagValue> ApplyTable(const Options& options, const toml::table& table,
                                  const std::string& where, bool flat) {
  std::vector<std::string> sections;
  for (const Option& option : options.all()) sections.push_back(option.section);
  std::vector<FlagValue> settings;
  for (const auto& [name, node] : table) {
    const std::string key(name.str());
    const auto* section = node.as_table();
    if (flat && section == nullptr) {
      settings.push_back(ApplyNode(options, "", key, node, where));
      continue;
    }
    const bool is_known = std::ranges::find(sections, key) != sections.end();
    if (section == nullptr && is_known && options.Get(key) == nullptr) {  // [agent] has a namesake
      throw BadInput(
          Concat(PlaceOf(node, where), ": expected a table [", key, "], got another type"));
    }
    if (section == nullptr) {
      const Option& option = *options.Find(key, PlaceOf(node, where)).front();
      throw BadInput(Concat(PlaceOf(node, where), ": ", key, ": expected in section [",
                            option.section, "], got outside any section"));
    }
    if (!is_known) {
      throw BadInput(Concat(PlaceOf(node, where), ": expected a known section, got [", key, "]",
                            DidYouMean(key, sections)));
    }
    for (const auto& [inner, value] : *section) {
      settings.push_back(ApplyNode(options, key, std::string(inner.str()), value, where));
    }
  }
  return settings;
}

}  // namespace upswing
