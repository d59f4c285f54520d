#pragma once

#include <span>

#include "judge/eval_report.h"

namespace upswing {

/// Whether an agent's expected discounted reward differs from the attained one by over a quarter.
bool ValueIsOff(double expected, double attained);

/// Prints an evaluation on standard output.
void PrintEvalTable(const EvalReport& report);

/// Prints several evaluations of the same episodes, and the difference of each to the first.
void PrintEvalComparison(std::span<const EvalReport> reports,
                         std::span<const Undesigned> undesigned);

}  // namespace upswing
