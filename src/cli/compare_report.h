#pragma once

#include <string>

#include "runs/compare.h"

namespace upswing {

/// Prints a comparison as tables.
void PrintComparison(const Comparison& comparison);

/// Prints which files WriteComparison has written.
void PrintWritten(const std::vector<std::string>& files);

/// A comparison as JSON, with every run's figures. A figure that is not reached (the time to solve
/// of an unsolved run) is null.
std::string ComparisonJson(const Comparison& comparison);

}  // namespace upswing
