#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

/// Helpers for tests with measured data.
namespace upswing {

/// The folder of the measured data: UPSWING_REAL, or `../shared/real` next to the project's root.
/// Empty if there is none; a test then skips.
inline std::filesystem::path RealData() {
  const char* given = std::getenv("UPSWING_REAL");
  const std::filesystem::path root = std::filesystem::path(__FILE__).parent_path().parent_path();
  const std::filesystem::path folder = given != nullptr ? given : root / "../shared/real";
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

}  // namespace upswing
