#include "runs/comparison.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace upswing {
namespace {

Scores ScoresOf(std::vector<double> values) {
  const auto [low, high] = std::ranges::minmax(values);
  const double median = QuartilesOf(values).median;
  const Estimate iqm = EstimateIqm(values);
  return {std::move(values), low, median, high, iqm};
}

/// Time of the evaluation that solved the run. An unsolved run counts as infinity, because it needs
/// an unknown amount more than its budget.
double SolveSeconds(const RunRecord& run) {
  const auto at = SolvedAt(run);
  return at ? run.evaluations[*at].seconds : EvaluationRow::kUnknown;
}
double SolveSteps(const RunRecord& run) {
  const auto at = SolvedAt(run);
  return at ? static_cast<double>(run.evaluations[*at].step) : EvaluationRow::kUnknown;
}

/// The evaluation of the policy that the run kept.
const EvaluationRow& Best(const RunRecord& run) {
  const EvaluationRule rule = run.config.Spec().evaluation;
  return *std::ranges::max_element(run.evaluations, {}, [&](const EvaluationRow& row) {
    return rule.Score(row.success_rate, row.mean_return);
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
      if (rate >= kSteadyRate) ++s.steady_evaluations;
      s.lowest = std::min(s.lowest, rate);
      steady = steady && rate >= kSteadyRate;
    }
    ++s.runs;
    if (steady) ++s.steady_runs;
  }
  return s;
}

/// Negated times, so that larger is better.
std::vector<double> Negated(std::vector<double> values) {
  for (double& value : values) value = -value;
  return values;
}

bool AllFinite(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

}  // namespace

std::span<const RunFigure> RunFigures() {
  using R = const RunRecord&;
  using S = GroupSummary;
  using enum RunFigure::Unit;
  static constexpr RunFigure kFigures[] = {
      {"solve_seconds", "time to solve", kSeconds, &S::solve_seconds, SolveSeconds},
      {"solve_steps", "steps to solve", kSteps, &S::solve_steps, SolveSteps},
      {"final_return", "final return", kReturn, &S::final_return,
       [](R run) { return run.evaluations.back().mean_return; }},
      {"final_success", "final success", kShare, &S::final_success,
       [](R run) { return run.evaluations.back().success_rate; }},
      {"final_value_ratio", "value/attained", kRatio, &S::value_ratio,
       [](R run) { return run.evaluations.back().value_ratio; }},
      {"best_return", "best return", kReturn, &S::best_return,
       [](R run) { return Best(run).mean_return; }},
      {"best_success", "best success", kShare, &S::best_success,
       [](R run) { return Best(run).success_rate; }},
      {"best_rms_torque", "rms torque", kTorque, &S::rms_torque,
       [](R run) { return Best(run).rms_torque; }},
      {"best_torque_variation", "torque change", kTorqueRate, &S::torque_variation,
       [](R run) { return Best(run).torque_variation; }},
      {"best_torque_variation_upright", "  once upright", kTorqueRate, &S::upright_variation,
       [](R run) { return Best(run).upright_variation; }},
  };
  return kFigures;
}

GroupSummary Summarize(const RunGroup& group) {
  GroupSummary s;
  s.solved =
      std::ranges::count_if(group.runs, [](const RunRecord& run) { return bool(SolvedAt(run)); });
  s.solved_interval = WilsonInterval(s.solved, std::ssize(group.runs));
  for (const RunFigure& figure : RunFigures()) {
    std::vector<double> values;
    for (const RunRecord& run : group.runs) values.push_back(figure.of(run));
    s.*figure.scores = ScoresOf(std::move(values));
  }
  s.stability = StabilityOf(group);
  return s;
}

PairSummary ComparePair(const std::vector<RunGroup>& groups, size_t a, size_t b) {
  const auto compare = [&](Scores GroupSummary::*scores, bool less_is_better) {
    const std::vector<double>& of_a = (groups[a].summary.*scores).values;
    const std::vector<double>& of_b = (groups[b].summary.*scores).values;
    PairFigure figure;
    figure.better = less_is_better ? EstimateImprovement(Negated(of_a), Negated(of_b))
                                   : EstimateImprovement(of_a, of_b);
    if (AllFinite(of_a) && AllFinite(of_b)) {
      figure.difference = EstimateIqmDifference(of_a, of_b);
    }
    return figure;
  };
  return {a, b, compare(&GroupSummary::solve_seconds, true),
          compare(&GroupSummary::solve_steps, true), compare(&GroupSummary::final_return, false)};
}

}  // namespace upswing
