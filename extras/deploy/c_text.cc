#include "extras/deploy/c_text.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "base/text.h"

namespace upswing::deploy {

std::string CommentText(std::string_view text) {
  const auto is_unsafe = [](char c) {
    const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    return !is_letter && std::string_view("0123456789 .,:;()+-=_").find(c) == std::string::npos;
  };
  std::string safe(text);
  std::ranges::replace_if(safe, is_unsafe, '_');
  return safe;
}

std::string CLiteral(float value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.begin(), text.end(), value).ptr;
  std::string literal(text.begin(), end);
  if (literal.find_first_of(".e") == std::string::npos) literal += ".0";
  return literal + "f";
}

std::string UpperCase(std::string text) {
  for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return text;
}

std::string Cleaned(std::string_view text, char separator) {
  std::string cleaned;
  for (const char c : text) {
    const bool is_capital = c >= 'A' && c <= 'Z';
    const char small = is_capital ? static_cast<char>(c - 'A' + 'a') : c;
    const bool fits = (small >= 'a' && small <= 'z') || (small >= '0' && small <= '9');
    if (fits) cleaned += small;
    if (!fits && !cleaned.empty() && cleaned.back() != separator) cleaned += separator;
  }
  if (cleaned.ends_with(separator)) cleaned.pop_back();
  return cleaned;
}

std::string Paragraph(std::string_view text) {
  return " * " + Replaced(WrapText(text, kWidth - 3), "\n", "\n * ");
}

}  // namespace upswing::deploy
