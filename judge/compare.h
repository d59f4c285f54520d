#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/thread_pool.h"
#include "judge/compare_runs.h"
#include "report/comparison.h"
#include "rl/evaluate.h"
#include "setup/loaded_policy.h"

/// Groups of runs, and policies and controllers beside them: these have no seeds and nothing to
/// solve, but do have a return.
namespace upswing {

/// A policy on the task of some groups of runs.
struct JudgedPolicy {
  std::string name, title;  // as it was typed; short, for a figure
  int task = 0;             // as GroupedRuns::tasks
  int64_t runs = 0;         // over the episodes of the final evaluations of so many
  EnvSpec spec;
  Evaluation figures;

  /// Whether it has figures of being upright.
  bool upright() const { return !spec.evaluation.by_return() && figures.successes > 0; }
};

/// A group of runs beside a policy on the same task.
struct AgainstPolicy {
  size_t group, policy;
  int64_t higher;            // how many runs have the higher final return
  Interval higher_interval;  // 95%, of their share
  Estimate difference;       // of the IQM of the runs' final returns, to the policy's return
};

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

/// Judges policies on each task that the groups are evaluated on, over the episodes of the runs'
/// final evaluations, and sets them beside the groups. With `make_anew` controllers are made for
/// the plant of these. What is not judged on some task is noted. `progress` counts episodes. Throws
/// BadInput, before any episode, where a policy is of none of the tasks.
void AddPolicies(const std::vector<LoadedPolicy>& policies, bool make_anew, ThreadPool& pool,
                 const Progress& progress, Comparison& comparison);

/// Writes summary.csv (a row for each group), runs.csv (a row for each run), policies.csv (a row
/// for each policy and task, if there are any) and the learning curves of each task as
/// CurvesName(task).svg and .png, in place of those that are there. Throws Failure if it cannot
/// write or draw.
void WriteComparison(const Comparison& comparison, const std::filesystem::path& folder);

}  // namespace upswing
