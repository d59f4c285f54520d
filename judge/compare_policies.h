#pragma once

#include <string>
#include <vector>

#include "core/thread_pool.h"
#include "judge/compare_runs.h"
#include "report/comparison.h"
#include "rl/evaluate.h"
#include "setup/loaded_policy.h"

/// Policies and controllers beside trainings: they have no seeds and nothing to solve, but do have
/// a return.
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

/// At most so many episodes of a task, unless one run's evaluation has more.
inline constexpr int64_t kMostJudged = 1000;

/// Judges policies on each task that the groups are evaluated on, over the episodes of the runs'
/// final evaluations. With `make_anew` controllers are made for the plant of these. What is not
/// judged on some task is noted. `progress` counts episodes. Throws BadInput, before any episode,
/// where a policy is of none of the tasks.
std::vector<JudgedPolicy> JudgePolicies(const std::vector<LoadedPolicy>& policies, bool make_anew,
                                        ThreadPool& pool, const Progress& progress,
                                        GroupedRuns& runs);

AgainstPolicy CompareWithPolicy(const GroupSummary& group, const JudgedPolicy& policy);

}  // namespace upswing
