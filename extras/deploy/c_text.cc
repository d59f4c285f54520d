#include "extras/deploy/c_text.h"

#include <array>
#include <charconv>

#include "base/text.h"

namespace upswing::deploy {
namespace {

constexpr size_t kWidth = 100;

bool IsPlain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view(" .,:;()+-=_").find(c) != std::string_view::npos;
}

}  // namespace

std::string CommentText(std::string_view text) {
  std::string safe(text);
  for (char& c : safe) c = IsPlain(c) ? c : '_';
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

std::string Wrapped(const std::vector<std::string>& words, const std::string& indent,
                    size_t column) {
  std::string text;
  for (const std::string& word : words) {
    const bool first = &word == &words.front();
    if (!first && column + 1 + word.size() > kWidth) {
      text += "\n" + indent;
      column = indent.size();
    } else if (!first) {
      text += ' ';
      ++column;
    }
    text += word;
    column += word.size();
  }
  return text;
}

std::string Paragraph(std::string_view text) {
  std::vector<std::string> words;
  for (const std::string_view word : Split(text, ' ')) words.emplace_back(word);
  return " * " + Wrapped(words, " * ", 3);
}

}  // namespace upswing::deploy
