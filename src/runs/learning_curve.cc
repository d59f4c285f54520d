#include "runs/learning_curve.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "base/text.h"

namespace upswing {
namespace {

constexpr int64_t kCurveResamples = 2000;  // at each x
constexpr double kIntervals = 200;         // of a grid

/// y of one run at `x`, interpolated.
double At(const RunRecord& run, const CurveAxis& x_of, const CurveAxis& y_of, double x) {
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

/// The x at which the longest run ends.
double LastOf(const std::vector<RunGroup>& groups, const CurveAxis& x) {
  double last = 0;
  for (const RunGroup& group : groups) {
    for (const RunRecord& run : group.runs) last = std::max(last, x(run.evaluations.back()));
  }
  return last;
}

/// The x at which the first run of the group ends.
double FirstEnd(const RunGroup& group, const CurveAxis& x) {
  double first = x(group.runs.front().evaluations.back());
  for (const RunRecord& run : group.runs) first = std::min(first, x(run.evaluations.back()));
  return first;
}

/// Splits the groups into parts of almost equal size, at most kMostCurves each.
std::vector<std::vector<RunGroup>> Parts(const std::vector<RunGroup>& groups) {
  const size_t count = (groups.size() + kMostCurves - 1) / kMostCurves;
  std::vector<std::vector<RunGroup>> parts(count);
  for (size_t i = 0; i < groups.size(); ++i) parts[i * count / groups.size()].push_back(groups[i]);
  return parts;
}

/// A quantity and the quantity that it is drawn over.
struct Axes {
  const char *x_label, *y_label;
  CurveAxis x, y;
};

Panel CurvesPanel(const std::vector<RunGroup>& groups, const Axes& axes, double end, bool legend) {
  Panel panel{.x_label = axes.x_label, .y_label = axes.y_label, .x_range = {{0, end}}};
  for (const RunGroup& group : groups) {
    std::vector<double> grid = CurveGrid(group, axes.x, end);
    const double first_end = FirstEnd(group, axes.x);
    const auto dotted_from = std::ranges::lower_bound(grid, first_end);
    Line& line = panel.lines.emplace_back(LearningCurve(group, axes.x, axes.y, grid));
    if (first_end < end && dotted_from != grid.end()) line.dotted_from = *dotted_from;
    line.name = legend ? Concat(group.label, " (n = ", group.runs.size(), ")") : "";
  }
  return panel;
}

/// The range from 0, or from the smallest number if it is negative, to the largest number of all
/// lines.
std::pair<double, double> RangeFromZero(const std::vector<const Panel*>& panels) {
  double low = 0, high = 0;
  for (const Panel* panel : panels) {
    for (const Line& line : panel->lines) {
      for (const auto* values : {&line.y, &line.low, &line.high}) {
        for (const double y : *values) {
          low = std::min(low, y);
          high = std::max(high, y);
        }
      }
    }
  }
  return {1.04 * low, high > low ? 1.04 * high : 1};
}

}  // namespace

Line LearningCurve(const RunGroup& group, const CurveAxis& x, const CurveAxis& y,
                   const std::vector<double>& grid) {
  Line line{.name = group.label, .x = grid};
  for (const double place : grid) {
    std::vector<double> values;
    for (const RunRecord& run : group.runs) values.push_back(At(run, x, y, place));
    const Estimate iqm = EstimateIqm(values, kCurveResamples);
    line.y.push_back(iqm.value);
    if (group.runs.size() < 2) continue;
    // If all runs agree, the band has zero width.
    line.low.push_back(iqm.interval ? iqm.interval->low : iqm.value);
    line.high.push_back(iqm.interval ? iqm.interval->high : iqm.value);
  }
  return line;
}

std::vector<double> CurveGrid(const RunGroup& group, const CurveAxis& x, double end) {
  double begin = 0;
  for (const RunRecord& run : group.runs) begin = std::max(begin, x(run.evaluations.front()));
  if (begin >= end) return {begin};
  std::vector<double> grid;
  for (double i = 0; i <= kIntervals; ++i) grid.push_back(std::lerp(begin, end, i / kIntervals));
  return grid;
}

Figure LearningCurves(const std::vector<RunGroup>& groups) {
  const auto parts = Parts(groups);
  Figure figure{.columns = 2,
                .width = 1200,
                .height = 40 + 760 * static_cast<int>(parts.size()),
                .caption =
                    "Interquartile mean over the n runs of each agent, with the pointwise "
                    "95% bootstrap interval as a band (none for n = 1)."};
  constexpr const char *kSteps = "steps", *kSeconds = "training time (s), evaluations excluded";
  constexpr const char *kSuccess = "success (%)", *kReturn = "return over 10 s";
  const Axes axes[] = {{kSteps, kSuccess, Steps, SuccessPercent},
                       {kSeconds, kSuccess, Seconds, SuccessPercent},
                       {kSteps, kReturn, Steps, Return},
                       {kSeconds, kReturn, Seconds, Return}};
  for (const std::vector<RunGroup>& part : parts) {
    for (size_t k = 0; k < std::size(axes); ++k) {
      // One legend, at the right of the upper row.
      const double end = LastOf(groups, axes[k].x);
      figure.panels.push_back(CurvesPanel(part, axes[k], end, k == 1));
    }
  }
  std::vector<const Panel*> returns;
  bool dotted = false;
  for (const Panel& panel : figure.panels) {
    if (panel.y_label == kReturn) returns.push_back(&panel);
    for (const Line& line : panel.lines) dotted = dotted || line.dotted_from;
  }
  if (dotted) figure.caption += " Dotted: a run has ended and keeps its last value.";
  const auto return_range = RangeFromZero(returns);
  for (Panel& panel : figure.panels) {
    panel.y_range = panel.y_label == kReturn ? return_range : std::pair(0.0, 102.0);
  }
  return figure;
}

}  // namespace upswing
