#include "report/learning_curve.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace upswing {
namespace {

constexpr int64_t kCurveResamples = 2000;  // at each point
constexpr double kIntervals = 200;         // of a grid

/// y of one run at `x`.
double At(const RunRecord& run, const EvaluationFigure& x_of, const EvaluationFigure& y_of,
          double x) {
  const auto& rows = run.evaluations;
  const auto after = std::ranges::lower_bound(rows, x, {}, x_of);
  if (after == rows.end()) return y_of(rows.back());
  if (after == rows.begin() || x_of(*after) == x) return y_of(*after);
  const auto before = std::prev(after);
  const double share = (x - x_of(*before)) / (x_of(*after) - x_of(*before));
  return std::lerp(y_of(*before), y_of(*after), share);
}

double Steps(const EvaluationRow& row) { return static_cast<double>(row.step); }
double Seconds(const EvaluationRow& row) { return row.seconds; }
double SuccessPercent(const EvaluationRow& row) { return 100 * row.success_rate; }
double Return(const EvaluationRow& row) { return row.mean_return; }

/// Where the longest run ends.
double LastOf(const std::vector<RunGroup>& groups, const EvaluationFigure& x) {
  double last = 0;
  for (const RunGroup& group : groups) {
    for (const RunRecord& run : group.runs) last = std::max(last, x(run.evaluations.back()));
  }
  return last;
}

/// Whether a run ends before the longest one does, in steps.
bool AnyHolds(const std::vector<RunGroup>& groups) {
  const double last = LastOf(groups, Steps);
  return std::ranges::any_of(groups, [&](const RunGroup& group) {
    return std::ranges::any_of(
        group.runs, [&](const RunRecord& run) { return Steps(run.evaluations.back()) < last; });
  });
}

}  // namespace

Line LearningCurve(const RunGroup& group, const EvaluationFigure& x, const EvaluationFigure& y,
                   const std::vector<double>& grid) {
  Line line;
  line.name = group.label;
  line.x = grid;
  for (const double place : grid) {
    std::vector<double> values;
    for (const RunRecord& run : group.runs) values.push_back(At(run, x, y, place));
    const Estimate iqm = EstimateIqm({values}, kCurveResamples);
    line.y.push_back(iqm.value);
    if (!iqm.interval) continue;
    line.low.push_back(iqm.interval->low);
    line.high.push_back(iqm.interval->high);
  }
  return line;
}

std::vector<double> CurveGrid(const RunGroup& group, const EvaluationFigure& x, double end) {
  double begin = 0;
  for (const RunRecord& run : group.runs) begin = std::max(begin, x(run.evaluations.front()));
  if (begin >= end) return {begin};
  std::vector<double> grid;
  for (double i = 0; i <= kIntervals; ++i) grid.push_back(std::lerp(begin, end, i / kIntervals));
  return grid;
}

Figure LearningCurves(const std::vector<RunGroup>& groups) {
  Figure figure;
  figure.title = "Interquartile mean over runs, pointwise 95% bootstrap interval";
  if (AnyHolds(groups)) figure.title += "; a run that ended early keeps its last value";
  figure.columns = 2;
  figure.width = 1200;
  figure.height = 800;
  const auto add = [&](const char* x_label, const EvaluationFigure& x, const char* y_label,
                       const EvaluationFigure& y) -> Panel& {
    Panel& panel = figure.panels.emplace_back();
    panel.x_label = x_label;
    panel.y_label = y_label;
    const double end = LastOf(groups, x);
    for (const RunGroup& group : groups) {
      panel.lines.push_back(LearningCurve(group, x, y, CurveGrid(group, x, end)));
      // One legend, at the right of the upper row, is enough.
      if (figure.panels.size() != 2) panel.lines.back().name.clear();
    }
    return panel;
  };
  constexpr const char* kSteps = "steps";
  constexpr const char* kSeconds = "training time (s), evaluations excluded";
  add(kSteps, Steps, "success (%)", SuccessPercent).y_range = {-2, 102};
  add(kSeconds, Seconds, "success (%)", SuccessPercent).y_range = {-2, 102};
  add(kSteps, Steps, "return over 10 s", Return);
  add(kSeconds, Seconds, "return over 10 s", Return);
  return figure;
}

}  // namespace upswing
