#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "report/runs.h"
#include "run/run_log.h"
#include "setup/config.h"

namespace upswing {

/// Which runs to compare.
struct CompareRequest {
  std::vector<std::filesystem::path> paths;  // run folders, or folders that hold some, at any depth
  std::filesystem::path root = {};  // below it a run's folder names its variant; empty: each path
  bool unfinished = false;          // include runs that are not finished
  bool different_tasks = false;     // also compare groups evaluated on different tasks
};

/// Name (`section.key`) and value of a setting; that of the model's content is kModelContent.
using Setting = std::pair<std::string, std::string>;

/// A run with its settings.
struct FoundRun {
  RunRecord run;
  std::string agent, variant;     // its named agent; its folder's name within a study, or empty
  std::vector<Setting> settings;  // those that distinguish trainings, without the seed
  RunConditions conditions;       // what its times depend on
  std::shared_ptr<const Config> config = {};  // that of a study's variant has another seed
};

/// The runs that are compared, and a line for each that is not.
struct Found {
  std::vector<FoundRun> runs;
  std::vector<std::string> left_out, notes;

  void LeaveOut(const std::filesystem::path& path, std::string_view why);
};

/// As the name of a setting, which is the last one of a run: the content of the model.
inline constexpr const char* kModelContent = "model";

/// Finds and reads them. What is no run, cannot be read, has no evaluation, is unfinished (unless
/// asked for) or the same training as another is left out. Throws BadInput where a path is not
/// there, or where a run stands twice.
Found FindRuns(const CompareRequest& request);

}  // namespace upswing
