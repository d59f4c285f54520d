#pragma once

#include <string>
#include <string_view>
#include <vector>

/// Pieces of C source code.
namespace upswing {

/// `text`, which may come from an untrusted file, for a comment: nothing in it ends the comment or
/// the line, or begins a trigraph.
std::string CommentText(std::string_view text);

/// The shortest literal that reads back as the same finite float, such as `0.1f`.
std::string CLiteral(float value);

std::string UpperCase(std::string text);

/// `text` in small letters and digits, with one `separator` in place of anything else between them.
std::string Cleaned(std::string_view text, char separator);

/// `words` on lines of at most 100 characters, each line after the first behind `indent`; the first
/// has `column` characters already.
std::string Wrapped(const std::vector<std::string>& words, const std::string& indent,
                    size_t column = 0);

/// A paragraph of a comment: `text` on such lines, each behind " * ".
std::string Paragraph(std::string_view text);

}  // namespace upswing
