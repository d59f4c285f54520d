#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "runs/comparison.h"

/// Comparison of groups of runs with each other.
namespace upswing {

/// Which runs to compare.
struct CompareRequest {
  std::vector<std::string> paths = {};  // runs or folders of runs, at any depth
  std::filesystem::path root = {};      // base folder of variants' names; empty: each of `paths`
  bool unfinished = false;              // include runs that are not finished
  bool different_tasks = false;         // also compare groups evaluated on different tasks
};

/// Figures of groups of runs and of pairs of groups.
struct Comparison {
  std::vector<RunGroup> groups;    // in the order of their names
  std::vector<PairSummary> pairs;  // each group with each earlier one
  // Of each task: the settings that differ between tasks. CompareRequest::different_tasks: only
  // one.
  std::vector<std::string> task_texts;
  std::vector<std::string> notes;  // remarks, one line each
};

/// Compares runs. Notes and leaves out folders without a run, and runs that are unreadable,
/// unfinished (unless requested), without an evaluation, or the same training as another. Throws
/// BadInput if no run is left, or a path does not exist, is a policy or is given twice.
Comparison Compare(const CompareRequest& request);

/// Writes summary.csv (a row for each group), runs.csv (a row for each run), and each task's
/// learning curves as curves.svg and .png, curves-2.svg, …, if possible. Replaces existing files.
/// Returns the files. Throws Failure if it cannot write.
std::vector<std::string> WriteComparison(const Comparison& comparison,
                                         const std::filesystem::path& folder);

}  // namespace upswing
