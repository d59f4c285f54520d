#pragma once

#include "lab/eval_report.h"

namespace upswing {

/// Prints the report on standard output.
void PrintEvalTable(const EvalReport& report);

}  // namespace upswing
