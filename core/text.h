#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace upswing {

/// A text or a number on its way into Concat.
class Piece {
 public:
  explicit Piece(std::string_view text) : text_(text) {}
  explicit Piece(char character) : digits_{character}, text_(digits_.data(), 1) {}
  explicit Piece(std::signed_integral auto number) : text_(Write(int64_t{number})) {}
  explicit Piece(std::unsigned_integral auto number) : text_(Write(uint64_t{number})) {}
  explicit Piece(double number) : text_(Write(number)) {}
  Piece(const Piece&) = delete;  // its text may be its own digits
  Piece& operator=(const Piece&) = delete;

  std::string_view text() const { return text_; }

 private:
  std::string_view Write(int64_t number);
  std::string_view Write(uint64_t number);
  std::string_view Write(double number);

  std::array<char, 24> digits_;
  std::string_view text_;
};

std::string ConcatPieces(std::initializer_list<Piece> pieces);

/// Joins its arguments into one string, numbers with six digits.
template <typename... Parts>
std::string Concat(const Parts&... parts) {
  return ConcatPieces({Piece(parts)...});
}

/// The bytes of a string.
std::span<const std::byte> BytesOf(std::string_view text);

/// The shortest text that reads back as the same double, such as `0.1` or `1e-05`.
std::string FormatNumber(double value);

/// The whole of `text` as a finite or infinite number; nothing if it is anything else.
std::optional<double> ParseNumber(std::string_view text);

/// The whole of `text` as an integer, such as `12` or `1e6`; nothing if it is anything else.
std::optional<int64_t> ParseInteger(std::string_view text);

/// `text` without blanks at either end.
std::string_view Trim(std::string_view text);

/// The pieces of `text` between separators, each trimmed; "a,,b" has three.
std::vector<std::string_view> Split(std::string_view text, char separator);

/// `parts` with `separator` between them.
std::string Join(const std::vector<std::string>& parts, std::string_view separator);

/// The names of the rows of a table.
template <typename Rows>
std::vector<std::string> NamesOf(const Rows& rows) {
  std::vector<std::string> names;
  for (const auto& row : rows) names.emplace_back(row.name);
  return names;
}

/// `text` with each `from` replaced by `to`.
std::string Replaced(std::string text, std::string_view from, std::string_view to);

/// The last `digits` hexadecimal digits of a number.
std::string HexDigits(uint64_t number, int digits);

/// The number of characters of a UTF-8 text, each of which takes a column.
size_t Columns(std::string_view text);

/// `text` in lines of at most `columns` characters, broken at blanks. All lines but the first begin
/// with `indent` blanks; the first one stands behind as many columns, which the caller fills. A
/// longer word has a line of its own.
std::string WrapText(std::string_view text, size_t columns, size_t indent = 0);

/// `text`, which may come from an untrusted file, for one line of a terminal: control characters,
/// bytes that are not UTF-8, and the characters that reorder text or break lines are replaced by
/// escapes such as `\n`, `\x1b` or `\u202e`. Everything else, including backslashes, is kept.
std::string Printable(std::string_view text);

/// `text` as one word of a POSIX shell's command line: unchanged if that is safe, else in single
/// quotes. Control characters are kept, so a command with them is not fit to be printed.
std::string ShellQuoted(std::string_view text);

/// " (did you mean NAME?)" for the name nearest to `word` in edit distance, among equals the
/// one that begins and ends most as it does; if none is near, for a name whose words have
/// these initials, that begins with `word`, or that `word` begins with; "" if there is no such name
/// either.
std::string DidYouMean(std::string_view word, const std::vector<std::string>& names);

}  // namespace upswing
