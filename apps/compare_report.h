#pragma once

#include <filesystem>
#include <string>

#include "lab/compare.h"

namespace upswing {

/// Prints it as tables, and says that it was written to a folder, unless that is empty.
void PrintComparison(const Comparison& comparison, const std::filesystem::path& written_to);

/// The same as JSON, with every run's figures. What is not reached (the time to solve of a run that
/// never did) is null.
std::string ComparisonJson(const Comparison& comparison);

}  // namespace upswing
