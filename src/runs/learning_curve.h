#pragma once

#include <functional>
#include <vector>

#include "report/figure.h"
#include "runs/comparison.h"

namespace upswing {

/// A number of an evaluation, for one axis of a figure.
using CurveAxis = std::function<double(const EvaluationRow&)>;

/// The interquartile mean of `y` over the runs at each x of the grid, as a curve. The band is its
/// pointwise 95% interval (none for a single run). Between two evaluations of a run, y is
/// interpolated; after the last one, y keeps its value.
Line LearningCurve(const RunGroup& group, const CurveAxis& x, const CurveAxis& y,
                   const std::vector<double>& grid);

/// Equally spaced x up to `end`, from the first x at which every run of the group has an
/// evaluation.
std::vector<double> CurveGrid(const RunGroup& group, const CurveAxis& x, double end);

inline constexpr size_t kMostCurves = 5;  // in one panel

/// Success and return over steps and over training time: four panels with a curve for each group.
/// More than kMostCurves groups are split into parts with four panels each, all with the same axes.
/// A curve is dotted where at least one of its runs has ended and keeps its last value.
Figure LearningCurves(const std::vector<RunGroup>& groups);

}  // namespace upswing
