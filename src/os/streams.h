#pragma once

#include <string>
#include <string_view>
#include <vector>

/// Files named on a command line; `-` means standard input or output.
namespace upswing {

/// Whether a path means standard input or output.
inline bool IsStandardStream(std::string_view path) { return path == "-"; }

/// Name of an input in messages: the path, or `standard input`.
std::string InputName(const std::string& path);

/// Reads the text of the file as ReadOwnFile does, or all of standard input, which may be a pipe.
/// Throws BadInput if that fails or the text is larger than kMostTextBytes.
std::string ReadInput(const std::string& path);

/// Throws BadInput that names `flag` if the path is not writable. Call it before long work.
/// Standard output is always writable.
void CheckWritable(const std::string& flag, const std::string& path);

/// Throws as CheckWritable does, and if a file is there that the user does not `overwrite`.
void CheckNewOutput(const std::string& flag, const std::string& path, bool overwrite);

/// Whether a file that can be read starts with one of `beginnings`, which are shorter than 256
/// bytes. Only for regular files: reading a pipe waits for its writer.
bool StartsWithOneOf(const std::string& path, const std::vector<std::string>& beginnings);

/// Throws as CheckWritable does, and if the file is neither empty nor an older output. An older
/// output starts with one of `beginnings`; `kind` names it in the message.
void CheckReplaceable(const std::string& flag, const std::string& path, std::string_view kind,
                      const std::vector<std::string>& beginnings);

/// Writes a file as WriteNamedFile does, or writes to standard output.
void WriteOutput(const std::string& path, std::string_view text);

}  // namespace upswing
