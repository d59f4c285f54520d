#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/options.h"
#include "base/progress.h"
#include "base/thread_pool.h"
#include "rl/train/evaluate.h"

/// Grades of all policies of a class. The same files give the same grades on every machine: with
/// any vector instructions, C library and number of threads.
namespace upswing {

/// Half width of the box of random plants, as a share of the nominal plant (`--randomize`).
inline constexpr double kGradeBox = 0.25;

struct GradeConfig {
  int64_t seed = 0, episodes = 100, plants = 100;  // episodes on the nominal and on random plants

  /// Declares the settings in `options`: name, range, help.
  void Describe(Options& options);
};

/// The grade of one entry of the folder.
struct Grade {
  std::string name;     // of the student or team: the entry, without .safetensors if that is unique
  std::string file;     // path of the policy within the folder
  std::string refused;  // why there is no grade; empty: there is one
  std::string note;     // the plant of the training, an entry with the same file; may be empty
  int rank = 0;         // from 1; entries with the same figures share it
  Evaluation nominal, random;
  std::vector<PendulumState> motion;  // states of the first nominal episode, one per control step
};

/// Grades FOLDER/NAME.safetensors and FOLDER/NAME/policy.safetensors, best first: by successes,
/// then by return. Entries with the same successes and return share a rank. Other entries, broken
/// files and links are refused and come last. Entries whose names begin with a dot are ignored.
/// Switches the kernels to the portable path. `progress` counts episodes. Throws BadInput if the
/// folder cannot be read, or has no or too many entries.
std::vector<Grade> GradeFolder(const std::filesystem::path& folder, const GradeConfig& config,
                               ThreadPool& pool, const Progress& progress);

/// The grades as CSV, a row for each entry.
std::string GradesCsv(const std::vector<Grade>& grades);

/// The grades as a page with the leaderboard and the moving pendulums. It needs no other file and
/// no network.
std::string GradesPage(const std::vector<Grade>& grades, const GradeConfig& config);

}  // namespace upswing
