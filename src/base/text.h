#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace upswing {

/// Adds an argument of Concat to a text.
inline void AddTo(std::string& text, std::string_view part) { text += part; }
inline void AddTo(std::string& text, char part) { text += part; }
inline void AddTo(std::string& text, std::integral auto part) { text += std::to_string(part); }
void AddTo(std::string& text, double part);

/// Joins its arguments into one string. Numbers have six digits.
template <typename... Parts>
std::string Concat(const Parts&... parts) {
  std::string text;
  (AddTo(text, parts), ...);
  return text;
}

/// The bytes of a string.
std::span<const std::byte> BytesOf(std::string_view text);

/// The shortest text that reads back as the same double, such as `0.1` or `1e-05`.
std::string FormatNumber(double value);

/// Parses all of `text` as a finite or infinite number; nothing if that fails.
std::optional<double> ParseNumber(std::string_view text);

/// Parses all of `text` as an integer, such as `12` or `1e6`; nothing if that fails.
std::optional<int64_t> ParseInteger(std::string_view text);

/// `text` without the blanks at both ends.
std::string_view Trim(std::string_view text);

/// Splits `text` at the separators and trims each piece; "a,,b" has three pieces.
std::vector<std::string_view> Split(std::string_view text, char separator);

/// The words of `text`, which blanks and line ends separate.
std::vector<std::string> Words(std::string_view text);

/// Takes the first line off the rest of a text. Returns it trimmed.
std::string_view TakeLine(std::string_view& rest);

/// Joins `parts`, texts or numbers, with `separator` between them.
template <typename Parts = std::vector<std::string>>
std::string Join(const Parts& parts, std::string_view separator) {
  std::string joined;
  for (const auto& part : parts) {
    if (!joined.empty()) joined += separator;
    AddTo(joined, part);
  }
  return joined;
}

/// The member `name` of each row of a table.
template <typename Rows>
std::vector<std::string> NamesOf(const Rows& rows) {
  std::vector<std::string> names;
  for (const auto& row : rows) names.emplace_back(row.name);
  return names;
}

/// `text` with every `from` replaced by `to`.
std::string Replaced(std::string_view text, std::string_view from, std::string_view to);

/// The last `digits` hexadecimal digits of a number.
std::string HexDigits(uint64_t number, int digits);

/// Number of characters of a UTF-8 text. Each character takes one column.
size_t Columns(std::string_view text);

/// Wraps `text` at blanks into lines of at most `columns` characters. All lines except the first
/// begin with `indent` blanks. The caller fills the first `indent` columns of the first line. A
/// word that is too long has its own line.
std::string WrapText(std::string_view text, size_t columns, size_t indent = 0);

/// Makes `text`, which may come from an untrusted file, safe for one line of a terminal. Escapes
/// such as `\n`, `\x1b` or `\u202e` replace control characters, bytes that are not UTF-8, and
/// characters that reorder text or break lines. Everything else stays, including backslashes.
std::string Printable(std::string_view text);

/// A message as one Printable line. The middle of a very long message is left out.
std::string OneLine(std::string_view message);

/// `text` as one word of a POSIX shell's command line: unchanged if that is safe, otherwise in
/// single quotes. Control characters stay, so a command that contains them is not fit for printing.
std::string ShellQuoted(std::string_view text);

/// " (did you mean NAME?)" for the name nearest to `word` in edit distance. Among equally near
/// names, it takes the name that shares most letters with `word` at both ends. If no name is near,
/// it takes a name with these initials (`--lr`: `--learning-rate`), or a name that begins with
/// `word` or is a beginning of `word`. "" if there is no such name, or if `word` is too long for
/// one.
std::string DidYouMean(std::string_view word, const std::vector<std::string>& names);

}  // namespace upswing
