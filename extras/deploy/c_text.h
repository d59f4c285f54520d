#pragma once

#include <string>
#include <string_view>

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

/// Number of characters of a line.
inline constexpr size_t kWidth = 100;

/// A comment paragraph: `text` on lines of at most kWidth characters, each after " * ".
std::string Paragraph(std::string_view text);

}  // namespace upswing::deploy
