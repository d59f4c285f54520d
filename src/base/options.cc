#include "base/options.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;  // clang 14 needs it spelled out

/// Quotes a text as a TOML basic string, which has control characters only as \u001B.
std::string Quote(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < ' ' || byte == 0x7F) {
      quoted += Concat("\\u00", kDigits.substr(byte / 16, 1), kDigits.substr(byte % 16, 1));
      continue;
    }
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  quoted += '"';
  return quoted;
}

std::string RangeText(Range range) {
  const bool low = std::isfinite(range.low);
  const bool high = std::isfinite(range.high);
  if (low && high)
    return Concat(" in [", FormatNumber(range.low), ", ", FormatNumber(range.high), "]");
  if (low) return Concat(" of at least ", FormatNumber(range.low));
  if (high) return Concat(" of at most ", FormatNumber(range.high));
  return "";
}

/// A range with its unit, such as ` in [0, 1] kg`.
std::string RangeText(Range range, const std::string& unit) {
  const std::string text = RangeText(range);
  return text.empty() || unit.empty() ? text : Concat(text, " ", unit);
}

/// What a number must be, such as `a multiple of 0.02 in [0, 1]` or `1 or 2`.
std::string NumberText(Range range, double step, const std::string& unit) {
  if (step == 1 && range.high == range.low + 1) {
    return Concat(FormatNumber(range.low), " or ", FormatNumber(range.high));
  }
  if (step == 1) return "an integer" + RangeText(range, unit);
  return Concat(step == 0 ? "a number" : "a multiple of " + FormatNumber(step),
                RangeText(range, unit));
}

/// `0 to 1` or `0 to 1 in steps of 0.02`; empty if all numbers are allowed.
std::string RangeInWords(Range range, double step) {
  if (!std::isfinite(range.low) || !std::isfinite(range.high)) return "";
  return Concat(FormatNumber(range.low), " to ", FormatNumber(range.high),
                step > 0 ? " in steps of " + FormatNumber(step) : "");
}

/// A help line `HELP [UNIT] (VALUES; DEFAULT)` without its empty parts.
std::string HelpLine(const Option& option, const std::string& fallback) {
  std::string values =
      option.choices.empty() ? RangeInWords(option.range, option.step) : Join(option.choices, ", ");
  if (option.sentinel) values += Concat(" or ", FormatNumber(*option.sentinel));
  std::vector<std::string> notes{std::move(values), fallback.empty() ? "" : "default " + fallback};
  std::erase(notes, "");
  return Concat(option.help, option.unit.empty() ? "" : Concat(" [", option.unit, "]"),
                notes.empty() ? "" : Concat(" (", Join(notes, "; "), ")"));
}

/// Whether a number is a multiple of `step`, up to rounding. Always true if `step` is 0.
bool IsMultiple(double value, double step) {
  constexpr double kRounding = 1e-9;
  return step == 0 || std::abs(value - step * std::round(value / step)) <= kRounding;
}

/// Hint such as `; the nearest are 0.04 and 0.06` for a number in the range that is not a multiple
/// of `step`. Empty otherwise, and for integers.
std::string NearestText(std::string_view text, Range range, double step) {
  const auto value = ParseNumber(text);
  if (step == 1 || !value || !range.Contains(*value) || IsMultiple(*value, step)) return "";
  const auto multiple = [&](double count) {
    constexpr double kDigits = 1e12;  // 35 × 0.02 is 0.7, not 0.7000000000000001
    return FormatNumber(std::round(count * step * kDigits) / kDigits);
  };
  const double below = std::floor(*value / step);
  return Concat("; the nearest are ", multiple(below), " and ", multiple(below + 1));
}

/// A text with a blank in place of each line break and the blanks around it.
std::string OnOneLine(std::string_view text) {
  std::string line;
  for (const std::string_view piece : Split(text, '\n')) {
    const std::string_view words = Trim(piece);
    if (!line.empty() && !words.empty()) line += ' ';
    line += words;
  }
  return line;
}

/// Parses a list such as "64,64" or "[64, 64]"; nothing if an item is not an integer or is out of
/// range.
std::optional<std::vector<int64_t>> ParseList(std::string_view text, Range range) {
  text = Trim(text);
  if (text.starts_with('[') && text.ends_with(']')) text = Trim(text.substr(1, text.size() - 2));
  std::vector<int64_t> values;
  for (const std::string_view piece : Split(text, ',')) {
    const auto value = ParseInteger(piece);
    if (!value || !range.Contains(static_cast<double>(*value))) return std::nullopt;
    values.push_back(*value);
  }
  return values;
}

}  // namespace

std::string FlagOf(std::string name) {
  std::replace(name.begin(), name.end(), '_', '-');
  return Concat("--", name);
}

std::string Option::text() const {
  return std::visit(
      Overloaded{
          [](const bool* value) -> std::string { return *value ? "true" : "false"; },
          [](const int64_t* value) { return std::to_string(*value); },
          // The sum turns -0 into 0, which is what TOML reads in "-0".
          [](const double* value) { return FormatNumber(*value + 0.0); },
          [](const std::string* value) { return Quote(*value); },
          [](const std::vector<int64_t>* value) { return Concat("[", Join(*value, ", "), "]"); },
      },
      target);
}

std::string Option::plain_text() const {
  std::string value = text();
  if (const auto* words = std::get_if<std::string*>(&target)) value = **words;
  std::erase_if(value, [&](char c) {  // a list on a command line needs no brackets and blanks
    return std::holds_alternative<std::vector<int64_t>*>(target) &&
           (c == '[' || c == ']' || c == ' ');
  });
  return value;
}

std::string Option::on_command_line() const {
  if (const auto* on = std::get_if<bool*>(&target)) {
    return **on ? flag() : Concat("--no-", flag().substr(2));
  }
  return Concat(flag(), " ", ShellQuoted(plain_text()));
}

std::string Option::about() const { return HelpLine(*this, ""); }

std::string Option::about_with_default() const {
  return HelpLine(*this, usual.empty() ? plain_text() : usual);
}

std::string Option::expected() const {
  return std::visit(
      Overloaded{
          [](const bool*) -> std::string { return "true or false"; },
          [&](const int64_t*) { return Concat("an integer", RangeText(range, unit)); },
          [&](const double*) {
            const std::string text = NumberText(range, step, unit);
            return sentinel ? Concat(text, " or ", FormatNumber(*sentinel)) : text;
          },
          [&](const std::string*) -> std::string {
            return choices.empty() ? "a text" : Concat("one of ", Join(choices, ", "));
          },
          [&](const std::vector<int64_t>*) {
            return Concat("a list of integers", RangeText(range));
          },
      },
      target);
}

void Option::Set(std::string_view text, const std::string& where) const {
  const bool valid =
      std::visit(Overloaded{
                     [&](bool* value) {
                       if (text != "true" && text != "false") return false;
                       *value = text == "true";
                       return true;
                     },
                     [&](int64_t* value) {
                       const auto parsed = ParseInteger(text);
                       if (!parsed || !range.Contains(static_cast<double>(*parsed))) return false;
                       *value = *parsed;
                       return true;
                     },
                     [&](double* value) {
                       const auto parsed = ParseNumber(text);
                       if (!parsed || !std::isfinite(*parsed)) return false;
                       const bool in_range = range.Contains(*parsed) && IsMultiple(*parsed, step);
                       if (!in_range && parsed != sentinel) return false;
                       *value = *parsed;
                       return true;
                     },
                     [&](std::string* value) {
                       if (wraps) {
                         *value = OnOneLine(text);
                         return true;
                       }
                       if (text.find_first_of("\n\r") != std::string_view::npos) return false;
                       if (!choices.empty() && std::ranges::find(choices, text) == choices.end()) {
                         return false;
                       }
                       *value = text;
                       return true;
                     },
                     [&](std::vector<int64_t>* value) {
                       auto parsed = ParseList(text, range);
                       if (!parsed) return false;
                       *value = std::move(*parsed);
                       return true;
                     },
                 },
                 target);
  if (valid) return;
  throw BadInput(Concat(where, ": expected ", expected(), ", got \"", text, "\"",
                        NearestText(text, range, step)));
}

Option& Options::AddOption(Option::Target target, std::string_view name, Range range,
                           std::string_view unit, std::string_view help) {
  return options_.emplace_back(
      Option{section_, std::string(name), target, range, std::string(unit), std::string(help)});
}

Option& Options::AddChoice(std::string* target, std::string_view name,
                           std::vector<std::string> choices, std::string_view help) {
  Option& option = Add(target, name, help);
  option.choices = std::move(choices);
  return option;
}

void Options::Alias(std::string_view name, std::vector<std::string> members,
                    std::string_view help) {
  std::string text = help.empty() ? Concat("set ", Join(members, " and ")) : std::string(help);
  aliases_.push_back({section_, std::string(name), std::move(members), std::move(text)});
}

void Options::AddMissing(const Options& others) {
  for (const Option& option : others.options_) {
    if (Get(option.name) == nullptr) options_.push_back(option);
  }
  for (const AliasEntry& alias : others.aliases_) {
    const auto own = std::ranges::find(aliases_, alias.name, &AliasEntry::name);
    if (own == aliases_.end()) aliases_.push_back(alias);
  }
  missing_.insert(others.missing_.begin(), others.missing_.end());
}

void Options::Explain(std::string_view name, std::string_view why) {
  missing_[std::string(name)] = why;
}

std::string Options::WhyMissing(std::string_view name) const {
  const auto why = missing_.find(name);
  return why == missing_.end() ? "" : why->second;
}

const Option* Options::Get(std::string_view name) const {
  const auto found = std::ranges::find(options_, name, &Option::name);
  return found == options_.end() ? nullptr : &*found;
}

std::vector<const Option*> Options::Find(std::string_view name, const std::string& where) const {
  std::vector<std::string> names{std::string(name)};
  std::vector<std::string> known;
  for (const AliasEntry& alias : aliases_) {
    known.push_back(alias.name);
    if (alias.name == name) names = alias.members;
  }
  std::vector<const Option*> found;
  for (const Option& option : options_) {
    known.push_back(option.name);
    if (std::count(names.begin(), names.end(), option.name) != 0) found.push_back(&option);
  }
  if (const std::string why = WhyMissing(name); found.empty() && !why.empty()) {
    throw BadInput(Concat(where, ": ", why));
  }
  if (found.empty()) {
    std::string hint = DidYouMean(name, known);
    constexpr size_t kMostNames = 40;  // more would make the line unreadable
    if (hint.empty() && known.size() < kMostNames)
      hint = Concat("; expected one of ", Join(known, ", "));
    throw BadInput(Concat(where, ": expected a setting, got \"", name, "\"", hint));
  }
  return found;
}

void Options::Set(std::string_view name, std::string_view text, const std::string& where) const {
  for (const Option* option : Find(name, where)) option->Set(text, where);
}

std::string Options::Toml(bool comments, const std::function<bool(const Option&)>& wanted) const {
  std::string toml;
  std::string_view section;
  for (const Option& option : options_) {
    if (!wanted(option)) continue;
    if (option.section != section) {
      toml += Concat(toml.empty() ? "" : "\n", "[", option.section, "]\n");
      section = option.section;
    }
    toml += Concat(option.name, " = ", option.text());
    if (comments) toml += Concat("  # ", option.about());
    toml += '\n';
  }
  return toml;
}

std::vector<Difference> Differences(const Options& now, const Options& before) {
  std::vector<Difference> differences;
  for (const Option& option : now.all()) {
    const Option* other = before.Get(option.name);
    if (other == nullptr) {
      differences.push_back({option, std::nullopt});
    } else if (other->text() != option.text()) {
      differences.push_back({option, *other});
    }
  }
  return differences;
}

}  // namespace upswing
