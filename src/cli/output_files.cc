#include "cli/output_files.h"

#include <filesystem>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "os/streams.h"
#include "runs/find_policy.h"
#include "runs/run_folder.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// The existing files that a text can name.
std::vector<fs::path> FilesOf(const std::string& text) {
  std::error_code none;
  if (fs::is_directory(text, none)) return RunFolder::Files(text);
  if (const fs::path shipped = ShippedPolicy(text); !shipped.empty()) return {shipped};
  return {text};
}

Error Lost(const NamedFile& output, const NamedFile& other, const fs::path& file) {
  const bool by_path = file == other.text;
  return BadInput(Concat(output.argument, ": expected another file than ",
                         by_path ? "" : Concat(Printable(file.string()), " of "), other.argument,
                         " ", Printable(other.text), ", which would be lost"));
}

void ExpectOther(const NamedFile& output, const NamedFile& other) {
  std::error_code error;
  if (fs::is_regular_file(output.text, error)) {
    for (const fs::path& file : FilesOf(other.text)) {
      if (fs::equivalent(output.text, file, error)) throw Lost(output, other, file);
    }
    return;
  }
  // Other words are names: an agent, for example.
  if (!other.is_output || fs::exists(output.text, error)) return;
  const auto place = [&](const std::string& text) {
    return fs::weakly_canonical(fs::absolute(text), error);
  };
  if (place(output.text) == place(other.text)) {
    throw Lost(output, other, other.text);
  }
}

}  // namespace

void ExpectOtherOutputs(std::span<const NamedFile> files) {
  for (const NamedFile& output : files) {
    if (!output.is_output || output.text.empty() || IsStandardStream(output.text)) continue;
    for (const NamedFile& other : files) {
      if (&other != &output) ExpectOther(output, other);
    }
  }
}

}  // namespace upswing
