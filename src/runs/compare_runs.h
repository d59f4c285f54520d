#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "runs/compare.h"

namespace upswing {

/// The runs to compare, and a line for each one that is left out.
struct Found {
  std::vector<RunRecord> runs;
  std::vector<std::string> left_out, notes;

  void LeaveOut(const std::filesystem::path& path, std::string_view why);
};

/// Finds and reads the runs of a request. Leaves out folders without a run, and runs that are
/// unreadable, without an evaluation, unfinished (unless requested) or the same training as
/// another. Throws BadInput if a path does not exist or a run is given twice.
Found FindRuns(const CompareRequest& request);

/// Finds, reads and groups runs by their settings. Runs of one group differ only in the seed and in
/// settings that do not change the training, such as the number of threads. Throws as Compare does.
Comparison GroupRuns(const CompareRequest& request);

}  // namespace upswing
