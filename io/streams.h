#pragma once

#include <string>
#include <string_view>

/// Files that a command line names, where `-` stands for standard input or output.
namespace upswing {

/// Whether a path stands for standard input or output.
inline bool IsStandardStream(std::string_view path) { return path == "-"; }

/// What messages call it: the path, or `standard input`.
std::string InputName(const std::string& path);

/// The text of the file, or all of standard input. Throws BadInput if it cannot be read.
std::string ReadInput(const std::string& path);

/// Throws BadInput that names `flag` if a file of this path could not be written, for before long
/// work; standard output always can.
void CheckWritable(const std::string& flag, const std::string& path);

/// Writes the file as WriteNamedFile does, or standard output.
void WriteOutput(const std::string& path, std::string_view text);

}  // namespace upswing
