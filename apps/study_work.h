#pragma once

#include <filesystem>

namespace upswing {

/// A worker of the study in a folder: trains what no other one has, until nothing is left for it.
/// What a run prints goes to its log, a line about all to standard output. Returns the exit code:
/// 0, 1 if a run failed, kTryAgain if a signal stopped it.
int WorkOnStudy(const std::filesystem::path& folder);

/// Prints how far the study in a folder is, and who works on it.
int PrintStudyStatus(const std::filesystem::path& folder);

}  // namespace upswing
