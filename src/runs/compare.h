#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "agents/loaded_policy.h"
#include "base/progress.h"
#include "base/thread_pool.h"
#include "rl/evaluate.h"
#include "runs/comparison.h"

/// Comparison of groups of runs with each other, and with policies and controllers. A policy or
/// controller has a return, but no seeds and no time to solve.
namespace upswing {

/// Which runs to compare.
struct CompareRequest {
  std::vector<std::filesystem::path> paths;  // runs or folders of runs, at any depth
  std::filesystem::path root = {};  // base folder of variants' names; empty: each of `paths`
  bool unfinished = false;          // include runs that are not finished
  bool different_tasks = false;     // also compare groups evaluated on different tasks
};

/// A policy on the task of some groups of runs.
struct JudgedPolicy {
  std::string name, title;  // name as on the command line; short title for figures
  int task = 0;             // as RunGroup::task
  int64_t runs = 0;         // number of runs whose final evaluations give the episodes
  Evaluation figures;
};

/// A group of runs compared with a policy on the same task.
struct AgainstPolicy {
  size_t group, policy;
  int64_t higher;            // number of runs with a higher final return than the policy
  Interval higher_interval;  // 95%, of the share of these runs
  Estimate difference;       // IQM of the runs' final returns minus the policy's return
};

/// Figures of groups of runs, of pairs of groups and of policies.
struct Comparison {
  std::vector<RunGroup> groups;    // in the order of discovery
  std::vector<PairSummary> pairs;  // each group with each earlier one
  // Of each task: the settings that differ between tasks. CompareRequest::different_tasks: only
  // one.
  std::vector<std::string> task_texts;
  std::vector<std::string> notes;  // remarks, one line each
  std::vector<JudgedPolicy> policies;
  std::vector<AgainstPolicy> against;  // each group with each policy on its task
};

/// Compares runs. Notes and leaves out folders without a run, and runs that are unreadable,
/// unfinished (unless requested), without an evaluation, or the same training as another. Throws
/// BadInput if no run is left, a path does not exist, or a run is given twice.
Comparison Compare(const CompareRequest& request);

/// Evaluates policies on each task of the groups, over the episodes of the runs' final evaluations,
/// and adds them to the comparison. With `redesign`, controllers are designed for the plant of
/// these episodes. `progress` counts episodes. Throws BadInput, before any episode, if a policy has
/// its motor at another joint than the runs, or if runs are not of the double pendulum.
void AddPolicies(const std::vector<LoadedPolicy>& policies, bool redesign, ThreadPool& pool,
                 const Progress& progress, Comparison& comparison);

/// Writes summary.csv (a row for each group), runs.csv (a row for each run), and each task's
/// learning curves as curves.svg and .png, curves-2.svg, …, if possible. Replaces existing files.
/// Returns the files. Throws Failure if it cannot write.
std::vector<std::string> WriteComparison(const Comparison& comparison,
                                         const std::filesystem::path& folder);

}  // namespace upswing
