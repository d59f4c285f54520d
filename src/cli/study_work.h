#pragma once

#include <filesystem>

namespace upswing {

/// Exit code of a worker that was told to stop: "try again later" in sysexits.h.
inline constexpr int kTryAgain = 75;

/// Runs a worker of the study in a folder: trains unclaimed runs until none is left. A run's output
/// goes to its log, and a line about the worker to standard output. Returns the exit code: 0, 1 if
/// a run failed, kTryAgain if a signal stopped the worker.
int WorkOnStudy(const std::filesystem::path& folder);

/// Prints the progress and the workers of the study in a folder; as JSON the progress only.
int PrintStudyStatus(const std::filesystem::path& folder, bool as_json);

}  // namespace upswing
