#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "judge/compare.h"

namespace upswing {

/// The runs that are compared, and a line for each that is not.
struct Found {
  std::vector<RunRecord> runs;
  std::vector<std::string> left_out, notes;

  void LeaveOut(const std::filesystem::path& path, std::string_view why);
};

/// Finds and reads them. What is no run, cannot be read, has no evaluation, is unfinished (unless
/// asked for) or the same training as another is left out. Throws BadInput where a path is not
/// there, or where a run stands twice.
Found FindRuns(const CompareRequest& request);

/// Finds, reads and groups runs by their settings: those of one group differ only in the seed and
/// in settings that do not change the training, such as the number of threads. Throws as Compare.
Comparison GroupRuns(const CompareRequest& request);

}  // namespace upswing
