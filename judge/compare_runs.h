#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "judge/compare.h"

namespace upswing {

/// The runs that are compared, and a line for each that is not.
struct Found {
  std::vector<RunRecord> runs;
  // Of each run by its path, or of the variant that it is a seed of.
  std::map<std::filesystem::path, std::shared_ptr<const Config>> configs;
  std::vector<std::string> left_out, notes;

  void LeaveOut(const std::filesystem::path& path, std::string_view why);
};

/// As the name of a setting, which is the last one of a run: the content of the model.
inline constexpr const char* kModelContent = "model";

/// Finds and reads them. What is no run, cannot be read, has no evaluation, is unfinished (unless
/// asked for) or the same training as another is left out. Throws BadInput where a path is not
/// there, or where a run stands twice.
Found FindRuns(const CompareRequest& request);

/// Finds, reads and groups runs by their settings: those of one group differ only in the seed and
/// in settings that do not change the training, such as the number of threads. Throws as Compare.
Comparison GroupRuns(const CompareRequest& request);

}  // namespace upswing
