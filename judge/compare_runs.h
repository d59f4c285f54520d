#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "report/comparison.h"
#include "setup/config.h"

namespace upswing {

/// Which runs to compare.
struct CompareRequest {
  std::vector<std::filesystem::path> paths;  // run folders, or folders that hold some, at any depth
  std::filesystem::path root = {};  // below it a run's folder names its variant; empty: each path
  bool unfinished = false;          // include runs that are not finished
  bool different_tasks = false;     // also compare groups evaluated on different tasks
};

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

/// Runs by their settings: those of one group differ only in the seed and in settings that do not
/// change the training, such as the number of threads.
struct GroupedRuns {
  std::vector<RunGroup> groups;          // in the order in which they were found
  std::vector<std::string> differences;  // of each group: the settings in which not all agree
  std::vector<int> tasks;                // of each group: which task it is evaluated on, from 0
  std::vector<std::string> task_texts;   // of each task: the settings in which not all agree
  std::vector<std::string> notes;        // remarks on them, a line each
  // Of each group: the settings, in which its runs differ by seed and by what makes no other run.
  std::vector<std::shared_ptr<const Config>> configs;
};

/// Finds, reads and groups them. What is no run, cannot be read, is unfinished (unless asked for)
/// or the same training as another is left out, with a note. Throws BadInput where nothing is left,
/// where a path is not there, or where a run stands twice.
GroupedRuns GroupRuns(const CompareRequest& request);

}  // namespace upswing
