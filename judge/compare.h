#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/thread_pool.h"
#include "judge/comparison.h"
#include "rl/evaluate.h"
#include "setup/loaded_policy.h"

/// Comparison of groups of runs with each other and with policies and controllers, which have a
/// return but no seeds and no time to solve.
namespace upswing {

/// Which runs to compare.
struct CompareRequest {
  std::vector<std::filesystem::path> paths;  // runs or folders of runs, at any depth
  std::filesystem::path root = {};  // below it a run's folder names its variant; empty: each path
  bool unfinished = false;          // include runs that are not finished
  bool different_tasks = false;     // also compare groups evaluated on different tasks
};

/// A policy on the task of some groups of runs.
struct JudgedPolicy {
  std::string name, title;  // as on the command line; short, for a figure
  int task = 0;             // as RunGroup::task
  int64_t runs = 0;         // number of runs whose final evaluations give the episodes
  EnvSpec spec;
  Evaluation figures;

  /// Whether it has figures of being upright.
  bool upright() const { return !spec.evaluation.by_return() && figures.successes > 0; }
};

/// A group of runs compared with a policy on the same task.
struct AgainstPolicy {
  size_t group, policy;
  int64_t higher;            // how many runs have the higher final return
  Interval higher_interval;  // 95%, of their share
  Estimate difference;       // of the IQM of the runs' final returns, to the policy's return
};

/// Figures of groups of runs, of pairs of groups and of policies.
struct Comparison {
  std::vector<RunGroup> groups;         // in the order in which they were found
  std::vector<PairSummary> pairs;       // each group with each one before it
  std::vector<std::string> task_texts;  // of each task: the settings in which not all agree
  std::vector<std::string> notes;       // remarks, a line each
  std::vector<JudgedPolicy> policies;
  std::vector<AgainstPolicy> against;  // each group with each policy on its task
};

/// Number of tasks of the groups.
int NumTasks(const Comparison& comparison);

/// The name of the files with a task's learning curves, without ending: `curves`, `curves-2`, …
std::string CurvesName(int task);

/// Compares runs. Leaves out, with a note, folders without a run and runs that are unreadable,
/// unfinished (unless requested), without an evaluation or the same training as another. Throws
/// BadInput if no run is left, a path does not exist, or a run is given twice.
Comparison Compare(const CompareRequest& request);

/// Evaluates policies on each task of the groups, over the episodes of the runs' final evaluations,
/// and adds them to the comparison. With `redesign`, controllers are designed for the plant of
/// these episodes. Notes tasks without an evaluation of a policy. `progress` counts episodes.
/// Throws BadInput, before any episode, for a policy of none of the tasks.
void AddPolicies(const std::vector<LoadedPolicy>& policies, bool redesign, ThreadPool& pool,
                 const Progress& progress, Comparison& comparison);

/// Writes summary.csv (a row for each group), runs.csv (a row for each run), policies.csv (a row
/// for each policy and task, if there are any) and the learning curves of each task as
/// CurvesName(task).svg and .png, in place of those that are there. Throws Failure if it cannot
/// write or draw.
void WriteComparison(const Comparison& comparison, const std::filesystem::path& folder);

}  // namespace upswing
