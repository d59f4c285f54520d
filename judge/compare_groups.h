#pragma once

#include <string>
#include <vector>

#include "judge/compare_runs.h"
#include "report/comparison.h"

namespace upswing {

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
