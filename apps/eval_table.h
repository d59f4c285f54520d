#pragma once

#include <string>

#include "judge/eval_report.h"

namespace upswing {

/// Such as `34.18 ± 0.57`: two digits of the deviation, or its whole part, and the mean to as many
/// decimals.
std::string MomentsText(const Moments& m, double scale = 1);

/// Such as `2.74 s   (median; middle half 2.70 to 2.78 s)`.
std::string QuartilesText(const Quartiles& q);

/// Whether an agent expects over a quarter more or less, in discounted reward, than it attains.
bool ValueIsOff(double expected, double attained);

/// Prints the report on standard output.
void PrintEvalTable(const EvalReport& report);

}  // namespace upswing
