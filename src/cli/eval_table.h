#pragma once

#include <string>

#include "judge/eval_report.h"

namespace upswing {

/// Mean and deviation, such as `34.18 ± 0.57`. The deviation has two digits, or more if its whole
/// part has more. The mean has as many decimals as the deviation.
std::string MomentsText(const Moments& m, double scale = 1);

/// Median and quartiles, such as `2.74 s   (median; middle half 2.70 to 2.78 s)`.
std::string QuartilesText(const Quartiles& q);

/// Whether an agent's expected discounted reward differs from the attained one by over a quarter.
bool ValueIsOff(double expected, double attained);

/// Prints an evaluation on standard output.
void PrintEvalTable(const EvalReport& report);

}  // namespace upswing
