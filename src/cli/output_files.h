#pragma once

#include <span>
#include <string>

namespace upswing {

/// A text of the command line that may name a file.
struct NamedFile {
  std::string argument;  // in messages: `--plant` or `the argument`
  std::string text;
  bool is_output = false;  // the command writes it
};

/// Throws BadInput if a file to write is another file of the command line, to read or to write: a
/// file by its path, a run's file by its folder, or a shipped policy by its name.
void ExpectOtherOutputs(std::span<const NamedFile> files);

}  // namespace upswing
