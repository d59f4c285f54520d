#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/sample.h"
#include "report/statistics.h"
#include "run/run_record.h"

namespace upswing {

inline constexpr double kSteadyRate = 0.99;  // success rate that a steady run keeps once solved

/// One quantity over the runs of a group.
struct Scores {
  std::vector<double> values;  // one for each run, in their order; not solved: +infinity
  double low, median, high;    // range and median
  Estimate iqm;                // interquartile mean
};

/// How well runs kept the solution: evaluations after the two that solved them.
struct Stability {
  int64_t runs = 0, steady_runs = 0;  // with such evaluations; all of them at least kSteadyRate
  int64_t evaluations = 0, steady_evaluations = 0;
  double lowest = 1;  // success rate
};

/// Summary of a group.
struct GroupSummary {
  int64_t solved;
  Interval solved_interval;            // 95%, of the share of runs that solve
  Scores solve_seconds, solve_steps;   // to the first of the two evaluations that solve
  Scores final_return, final_success;  // at the last evaluation
  Scores best_return, best_success;    // at the best one: by success, then by return
  // Of the torques at the best one (EvaluationRow); infinite where they are not known.
  Scores rms_torque, torque_variation, upright_variation;
  Scores value_ratio;  // at the last evaluation, expected over attained; infinite: nothing attained
  Stability stability;
};

/// Runs of one agent with different seeds.
struct RunGroup {
  std::string label;
  std::vector<RunRecord> runs;   // by seed; each has at least one evaluation
  std::string differences = {};  // from the other groups: settings in which not all agree
  int task = 0;                  // which of the groups' tasks it is evaluated on
  GroupSummary summary = {};     // of the runs
};
GroupSummary Summarize(const RunGroup& group);

/// A figure of a run, which GroupSummary has over the runs of a group.
struct RunFigure {
  enum class Kind { kSeconds, kSteps, kReturn, kShare, kTorque, kTorqueRate, kRatio };

  const char *name, *label;  // in files; for people
  Kind kind;
  Scores GroupSummary::*scores;
  double (*of)(const RunRecord&);  // infinite where it is not reached or not known
};
std::span<const RunFigure> RunFigures();

/// Comparison of two groups: differences are a - b.
struct PairSummary {
  size_t a, b;             // which groups
  Estimate sooner;         // probability that a run of a solves in less time than one of b
  Estimate higher_return;  // probability that its final return is higher
  /// Differences of the interquartile means; that of the times only if all runs are solved.
  std::optional<Estimate> seconds_difference;
  Estimate return_difference;
};
PairSummary ComparePair(const std::vector<RunGroup>& groups, size_t a, size_t b);

}  // namespace upswing
