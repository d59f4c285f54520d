#include "report/comparison.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace upswing {
namespace {

/// A figure of each run, summarised.
Scores ScoresOf(const RunGroup& group, const std::function<double(const RunRecord&)>& figure) {
  Scores scores;
  for (const RunRecord& run : group.runs) scores.values.push_back(figure(run));
  const auto [low, high] = std::ranges::minmax(scores.values);
  scores.low = low;
  scores.high = high;
  scores.median = QuartilesOf(scores.values).median;
  scores.iqm = EstimateIqm({scores.values});
  return scores;
}

/// A figure of the evaluation that solved the run. A run that is not solved would have needed an
/// unknown amount more than its budget: infinity.
double WhenSolved(const RunRecord& run, const std::function<double(const EvaluationRow&)>& figure) {
  const auto at = SolvedAt(run);
  return at ? figure(run.evaluations[*at]) : std::numeric_limits<double>::infinity();
}

/// The evaluation whose policy the run kept.
const EvaluationRow& Best(const RunRecord& run) {
  return *std::ranges::max_element(run.evaluations, {}, [&](const EvaluationRow& row) {
    return run.rule.Score(row.success_rate, row.mean_return);
  });
}

Stability StabilityOf(const RunGroup& group) {
  Stability s;
  for (const RunRecord& run : group.runs) {
    const auto solved_at = SolvedAt(run);
    if (!solved_at || *solved_at + 2 >= run.evaluations.size()) continue;
    bool steady = true;
    for (size_t i = *solved_at + 2; i < run.evaluations.size(); ++i) {
      const double rate = run.evaluations[i].success_rate;
      ++s.evaluations;
      s.steady_evaluations += rate >= kSteadyRate ? 1 : 0;
      s.lowest = std::min(s.lowest, rate);
      steady = steady && rate >= kSteadyRate;
    }
    ++s.runs;
    s.steady_runs += steady ? 1 : 0;
  }
  return s;
}

/// For times, of which shorter ones are better.
std::vector<double> Negated(std::vector<double> values) {
  for (double& value : values) value = -value;
  return values;
}

bool AllFinite(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

}  // namespace

GroupSummary Summarize(const RunGroup& group) {
  const auto seconds = [](const EvaluationRow& row) { return row.seconds; };
  const auto steps = [](const EvaluationRow& row) { return static_cast<double>(row.step); };
  GroupSummary s;
  s.solved =
      std::ranges::count_if(group.runs, [](const RunRecord& run) { return bool(SolvedAt(run)); });
  s.solved_interval = WilsonInterval(s.solved, static_cast<int64_t>(group.runs.size()));
  s.solve_seconds = ScoresOf(group, [&](const RunRecord& run) { return WhenSolved(run, seconds); });
  s.solve_steps = ScoresOf(group, [&](const RunRecord& run) { return WhenSolved(run, steps); });
  s.final_return =
      ScoresOf(group, [](const RunRecord& r) { return r.evaluations.back().mean_return; });
  s.final_success =
      ScoresOf(group, [](const RunRecord& r) { return r.evaluations.back().success_rate; });
  s.best_return = ScoresOf(group, [](const RunRecord& run) { return Best(run).mean_return; });
  s.best_success = ScoresOf(group, [](const RunRecord& run) { return Best(run).success_rate; });
  const auto of_best = [&](double EvaluationRow::*figure) {
    return ScoresOf(group, [&](const RunRecord& run) { return Best(run).*figure; });
  };
  s.rms_torque = of_best(&EvaluationRow::rms_torque);
  s.torque_variation = of_best(&EvaluationRow::torque_variation);
  s.upright_variation = of_best(&EvaluationRow::upright_variation);
  s.stability = StabilityOf(group);
  return s;
}

PairSummary ComparePair(const std::vector<GroupSummary>& groups, size_t a, size_t b) {
  const std::vector<double>& seconds_a = groups[a].solve_seconds.values;
  const std::vector<double>& seconds_b = groups[b].solve_seconds.values;
  const Strata return_a{groups[a].final_return.values}, return_b{groups[b].final_return.values};
  PairSummary pair{a, b, {}, {}, {}, {}};
  pair.sooner = EstimateImprovement({Negated(seconds_a)}, {Negated(seconds_b)});
  pair.higher_return = EstimateImprovement(return_a, return_b);
  if (AllFinite(seconds_a) && AllFinite(seconds_b)) {
    pair.seconds_difference = EstimateIqmDifference({seconds_a}, {seconds_b});
  }
  pair.return_difference = EstimateIqmDifference(return_a, return_b);
  return pair;
}

}  // namespace upswing
