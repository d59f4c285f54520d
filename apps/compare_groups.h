#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/comparison.h"

namespace upswing {

/// Which runs to compare.
struct CompareRequest {
  std::vector<std::filesystem::path> paths;  // run folders, or folders that hold some, at any depth
  std::filesystem::path root = {};  // below which a run's folder tells its variant; empty: its path
  bool unfinished = false;          // also those that have not come to their end
  bool different_tasks = false;     // also those that are judged on different tasks
};

/// Runs by their settings: those of one group differ in nothing but the seed and what makes no
/// other run of it.
struct GroupedRuns {
  std::vector<RunGroup> groups;          // in the order in which they were found
  std::vector<std::string> differences;  // of each group: the settings in which not all agree
  std::vector<std::string> notes;        // what to know of them, a line each
};

/// Finds, reads and groups them. Throws BadInput where there are none, where a run stands twice, is
/// unfinished (unless asked for), or where runs are judged on different tasks (likewise).
GroupedRuns GroupRuns(const CompareRequest& request);

}  // namespace upswing
