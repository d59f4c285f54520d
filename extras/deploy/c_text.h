#pragma once

#include <string>
#include <string_view>
#include <vector>

/// Helpers that write C source code.
namespace upswing::deploy {

/// `text`, which may come from an untrusted file, made safe for a comment: it cannot end the
/// comment or the line, or begin a trigraph.
std::string CommentText(std::string_view text);

/// The shortest literal that reads back as the same finite float, such as `0.1f`.
std::string CLiteral(float value);

std::string UpperCase(std::string text);

/// `text` reduced to small letters and digits, with one `separator` in place of any other
/// characters between them.
std::string Cleaned(std::string_view text, char separator);

/// `words` on lines of at most 100 characters; lines after the first begin with `indent`. The first
/// line already has `column` characters.
std::string Wrapped(const std::vector<std::string>& words, const std::string& indent,
                    size_t column = 0);

/// A comment paragraph: `text` on lines of at most 100 characters, each after " * ".
std::string Paragraph(std::string_view text);

}  // namespace upswing::deploy
