#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/sample.h"
#include "report/statistics.h"
#include "runs/run_record.h"

namespace upswing {

inline constexpr double kSteadyRate = 0.99;  // success rate that steady runs keep

/// One quantity over the runs of a group.
struct Scores {
  std::vector<double> values;  // one per run, in the group's order; +infinity if not solved
  double low, median, high;    // range and median
  Estimate iqm;                // interquartile mean
};

/// How well runs keep the solution, in the evaluations after the two that solve them.
struct Stability {
  int64_t runs = 0, steady_runs = 0;  // runs that have them; that keep kSteadyRate in all
  int64_t evaluations = 0, steady_evaluations = 0;
  double lowest = 1;  // success rate
};

/// Summary of a group.
struct GroupSummary {
  int64_t solved;
  Interval solved_interval;            // 95%, of the share of runs that solve
  Scores solve_seconds, solve_steps;   // to the first of the two evaluations that solve
  Scores final_return, final_success;  // at the last evaluation
  Scores best_return, best_success;    // at the best evaluation: by success, then by return
  // Torques at the best evaluation (EvaluationRow); infinite if unknown.
  Scores rms_torque, torque_variation, upright_variation;
  Scores value_ratio;  // expected over attained value at the end; infinite: nothing attained
  Stability stability;
};

/// Runs of one agent with different seeds.
struct RunGroup {
  std::string label;
  std::vector<RunRecord> runs;   // by seed; each has at least one evaluation
  std::string differences = {};  // from the other groups: the settings that differ
  int task = 0;                  // index of the task of its evaluations
  GroupSummary summary = {};     // of the runs
};
GroupSummary Summarize(const RunGroup& group);

/// A figure of a run; GroupSummary has the same figure over the runs of a group.
struct RunFigure {
  enum class Unit { kSeconds, kSteps, kReturn, kShare, kTorque, kTorqueRate, kRatio };

  const char *name, *label;  // in files; for readers
  Unit unit;
  Scores GroupSummary::*scores;
  double (*of)(const RunRecord&);  // infinite if not reached or unknown
};
std::span<const RunFigure> RunFigures();

/// A figure of group a compared with that of group b.
struct PairFigure {
  Estimate better;                     // probability that a run of a is better than one of b
  std::optional<Estimate> difference;  // IQM of a - IQM of b; nothing if a run is unsolved
};

struct PairSummary {
  size_t a, b;                // indices of the groups
  PairFigure seconds, steps;  // until solved; fewer are better
  PairFigure final_return;
};
PairSummary ComparePair(const std::vector<RunGroup>& groups, size_t a, size_t b);

}  // namespace upswing
