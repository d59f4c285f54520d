#include "os/command.h"

namespace upswing {
namespace {

/// Folder of the page and the examples, if this program is installed.
std::filesystem::path ShareOf(const std::filesystem::path& program) {
  return program.parent_path().parent_path() / "share/upswing";
}

}  // namespace

std::filesystem::path PageFile(const std::filesystem::path& name) {
  std::filesystem::path folder = CodePath();
  // Up to the source repository, from build/release/python/upswing.
  constexpr int kMostParents = 5;
  for (int parent = 0; parent < kMostParents; ++parent) {
    folder = folder.parent_path();
    for (const char* page : {"share/upswing/page", "web/public"}) {
      std::error_code none;
      if (std::filesystem::exists(folder / page / name, none)) return folder / page / name;
    }
  }
  return {};
}

std::filesystem::path SharePath() { return ShareOf(ProgramPath()); }

bool IsInstalled() {
  try {
    return std::filesystem::is_directory(ShareOf(ProgramPath()));
  } catch (const std::filesystem::filesystem_error&) {
    return false;
  }
}

}  // namespace upswing
