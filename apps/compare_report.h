#pragma once

#include <filesystem>
#include <string>

#include "judge/compare.h"

namespace upswing {

/// Prints it as tables.
void PrintComparison(const Comparison& comparison);

/// Says what was written to a folder.
void PrintWritten(const Comparison& comparison, const std::filesystem::path& folder);

/// The same as JSON, with every run's figures. What is not reached (the time to solve of a run that
/// never did) is null.
std::string ComparisonJson(const Comparison& comparison);

}  // namespace upswing
