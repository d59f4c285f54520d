#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "judge/compare_policies.h"
#include "report/comparison.h"

namespace upswing {

/// Groups of runs in figures, and pairs of groups beside each other; policies beside them.
struct Comparison {
  GroupedRuns runs;
  std::vector<GroupSummary> summaries;  // of each group
  std::vector<PairSummary> pairs;       // each group with each one before it
  std::vector<JudgedPolicy> policies = {};
  std::vector<AgainstPolicy> against = {};  // each group with each policy on its task
};

/// How many tasks groups are compared on.
size_t NumTasks(const Comparison& comparison);

/// The name of the files with a task's learning curves, without ending: `curves`, `curves-2`, …
std::string CurvesName(size_t task);

/// Compares runs; see GroupRuns. Throws BadInput.
Comparison Compare(const CompareRequest& request);

/// Judges policies (JudgePolicies) and sets them beside the groups.
void AddPolicies(const std::vector<LoadedPolicy>& policies, bool make_anew, ThreadPool& pool,
                 const Progress& progress, Comparison& comparison);

/// Writes summary.csv (a row for each group), runs.csv (a row for each run), policies.csv (a row
/// for each policy and task, if there are any) and the learning curves of each task as
/// CurvesName(task).svg and .png, in place of those that are there. Throws Failure if it cannot
/// write or draw.
void WriteComparison(const Comparison& comparison, const std::filesystem::path& folder);

}  // namespace upswing
