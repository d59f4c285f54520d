#include "base/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>
#include <utility>

namespace upswing {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

/// Levenshtein distance: number of insertions, deletions and substitutions that turn `a` into `b`.
size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = std::exchange(row[0], i);
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t substitution = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitution});
    }
  }
  return row.back();
}

/// Number of characters that two words share at the beginning and at the end.
size_t CommonEnds(std::string_view a, std::string_view b) {
  const size_t shorter = std::min(a.size(), b.size());
  const auto front = static_cast<size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
  size_t back = 0;
  while (back < shorter - front && a[a.size() - 1 - back] == b[b.size() - 1 - back]) ++back;
  return front + back;
}

template <typename T>
std::optional<T> ParseWhole(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Removes a leading plus, which from_chars does not accept.
std::string_view WithoutPlus(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  return text;
}

/// A character of a UTF-8 text and its number of bytes.
struct CodePoint {
  char32_t value;
  size_t size;
};

/// Bytes of the character that begins with this byte; 0 if none does.
size_t Utf8Size(unsigned char first) {
  if (first < 0x80) return 1;
  if (first < 0xc0) return 0;
  if (first < 0xe0) return 2;
  if (first < 0xf0) return 3;
  if (first < 0xf8) return 4;
  return 0;
}

/// The first character of `text`; nothing unless it is valid UTF-8 in its shortest form.
std::optional<CodePoint> FirstCodePoint(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const size_t size = Utf8Size(byte(0));
  if (size == 0 || size > text.size()) return std::nullopt;
  char32_t value = size == 1 ? byte(0) : byte(0) & (0x7fU >> size);
  for (size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return std::nullopt;
    value = value << 6 | (byte(i) & 0x3fU);
  }
  // Smallest character of each size.
  constexpr std::array<char32_t, 5> kSmallest{0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = value >= 0xd800 && value < 0xe000;
  if (value < kSmallest.at(size) || value > 0x10ffff || surrogate) return std::nullopt;
  return CodePoint{value, size};
}

/// Whether a terminal may do anything with the character other than show it in its place.
bool IsControl(char32_t c) {
  const auto in = [c](char32_t first, char32_t last) { return c >= first && c <= last; };
  return in(0, 0x1f) || in(0x7f, 0x9f) || c == 0x61c || in(0x200b, 0x200f) || in(0x2028, 0x202e) ||
         in(0x2060, 0x206f) || c == 0xfeff || in(0xfff9, 0xfffb) || in(0xfffe, 0xffff) ||
         in(0xe0000, 0xe007f);
}

/// An escape such as `\x1b`.
std::string Escape(char kind, char32_t value, int digits) {
  return Concat('\\', kind, HexDigits(value, digits));
}

/// The first letters of a name's words: "lr" for "--learning-rate".
std::string Initials(std::string_view name) {
  std::string initials;
  bool begins = true;
  for (const char c : name) {
    const bool separates = c == '-' || c == '_';
    if (begins && !separates) initials += c;
    begins = separates;
  }
  return initials;
}

}  // namespace

void AddTo(std::string& text, double part) {
  constexpr int kDigits = 6;
  std::array<char, 24> digits;
  text.append(
      digits.data(),
      std::to_chars(digits.begin(), digits.end(), part, std::chars_format::general, kDigits).ptr);
}

std::string FormatNumber(double value) {
  std::array<char, 32> buffer;
  // Write integers in full: 100000, not 1e+05.
  const bool integer = std::abs(value) < 1e16 && value == std::trunc(value);
  char* const end = buffer.data() + buffer.size();
  const auto result = integer ? std::to_chars(buffer.data(), end, value, std::chars_format::fixed)
                              : std::to_chars(buffer.data(), end, value);
  return {buffer.data(), result.ptr};
}

std::optional<double> ParseNumber(std::string_view text) {
  return ParseWhole<double>(WithoutPlus(text));
}

std::optional<int64_t> ParseInteger(std::string_view text) {
  if (const auto integer = ParseWhole<int64_t>(WithoutPlus(text))) return integer;
  constexpr double kLargest = 9007199254740992;  // 2^53: doubles are exact up to here
  const auto number = ParseNumber(text);
  if (!number || !(std::abs(*number) <= kLargest) || *number != std::trunc(*number)) {
    return std::nullopt;
  }
  return static_cast<int64_t>(*number);
}

std::string_view Trim(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> pieces;
  while (true) {
    const size_t at = text.find(separator);
    pieces.push_back(Trim(text.substr(0, at)));
    if (at == std::string_view::npos) return pieces;
    text.remove_prefix(at + 1);
  }
}

std::vector<std::string> Words(std::string_view text) {
  std::vector<std::string> words;
  for (size_t at = 0; (at = text.find_first_not_of(kBlanks, at)) != std::string_view::npos;) {
    const size_t end = std::min(text.find_first_of(kBlanks, at), text.size());
    words.emplace_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

std::string_view TakeLine(std::string_view& rest) {
  const size_t end = std::min(rest.find_first_of("\r\n"), rest.size());
  const std::string_view line = Trim(rest.substr(0, end));
  rest.remove_prefix(std::min(end + (rest.substr(end, 2) == "\r\n" ? 2 : 1), rest.size()));
  return line;
}

std::string Replaced(std::string_view text, std::string_view from, std::string_view to) {
  std::string replaced;  // in place, each replacement would move the rest of the text
  size_t begin = 0;
  for (size_t at = 0; (at = text.find(from, begin)) != std::string_view::npos;
       begin = at + from.size()) {
    replaced.append(text, begin, at - begin) += to;
  }
  return replaced.append(text, begin);
}

std::string HexDigits(uint64_t number, int digits) {
  std::string hex;
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) {
    hex += "0123456789abcdef"[(number >> shift) & 15];
  }
  return hex;
}

size_t Columns(std::string_view text) {
  // Continuation bytes take no column.
  return static_cast<size_t>(std::ranges::count_if(
      text, [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

std::string WrapText(std::string_view text, size_t columns, size_t indent) {
  std::string wrapped;
  size_t column = indent;  // current length of the line
  for (const std::string& word : Words(text)) {
    const bool is_first = column == indent;
    if (!is_first && column + 1 + Columns(word) > columns) {
      wrapped += '\n' + std::string(indent, ' ');
      column = indent;
    } else if (!is_first) {
      wrapped += ' ';
      ++column;
    }
    wrapped += word;
    column += Columns(word);
  }
  return wrapped;
}

std::string Printable(std::string_view text) {
  std::string shown;
  while (!text.empty()) {
    const auto c = FirstCodePoint(text);
    const size_t size = c ? c->size : 1;
    if (!c) {
      shown += Escape('x', static_cast<unsigned char>(text.front()), 2);
    } else if (!IsControl(c->value)) {
      shown += text.substr(0, size);
    } else if (c->value == '\n') {
      shown += "\\n";
    } else if (c->value == '\r') {
      shown += "\\r";
    } else if (c->value == '\t') {
      shown += "\\t";
    } else if (c->value < 0x80) {
      shown += Escape('x', c->value, 2);
    } else if (c->value < 0x10000) {
      shown += Escape('u', c->value, 4);
    } else {
      shown += Escape('U', c->value, 8);
    }
    text.remove_prefix(size);
  }
  return shown;
}

std::string OneLine(std::string_view message) {
  constexpr size_t kBegin = 1500;  // bytes
  constexpr size_t kEnd = 500;
  if (message.size() <= kBegin + kEnd) return Printable(message);
  return Concat(Printable(message.substr(0, kBegin)), " … ",
                Printable(message.substr(message.size() - kEnd)));
}

std::string ShellQuoted(std::string_view text) {
  constexpr std::string_view kSafe =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./,:=+@%";
  if (!text.empty() && text.find_first_not_of(kSafe) == std::string_view::npos) {
    return std::string(text);
  }
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string DidYouMean(std::string_view word, const std::vector<std::string>& names) {
  constexpr size_t kLongest = 64;  // bytes; no name is longer, and distances take long
  if (word.size() > kLongest) return "";
  std::string lower(word);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  word = lower;
  const auto nearest =
      std::min_element(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
        const size_t to_a = EditDistance(word, a), to_b = EditDistance(word, b);
        return to_a != to_b ? to_a < to_b : CommonEnds(word, a) > CommonEnds(word, b);
      });
  if (nearest == names.end()) return "";
  const auto letters_of = [](std::string_view text) {
    return text.substr(std::min(text.size(), text.find_first_not_of('-')));
  };
  const size_t letters = letters_of(word).size();
  const size_t tolerance = letters <= 3 ? 1 : std::max<size_t>(2, letters / 3);
  const auto meant = [](std::string_view name) { return Concat(" (did you mean ", name, "?)"); };
  if (EditDistance(word, *nearest) <= tolerance) return meant(*nearest);
  const auto abbreviated = std::ranges::find(names, letters_of(word), Initials);
  if (letters > 1 && abbreviated != names.end()) return meant(*abbreviated);
  constexpr size_t kFewest = 3;  // number of letters that two words must share
  const auto part = std::ranges::find_if(names, [&](const std::string& name) {
    const std::string_view given = letters_of(word), other = letters_of(name);
    return std::min(given.size(), other.size()) >= kFewest &&
           (given.starts_with(other) || other.starts_with(given) || given.ends_with(other));
  });
  return part == names.end() ? "" : meant(*part);
}

std::span<const std::byte> BytesOf(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

}  // namespace upswing
