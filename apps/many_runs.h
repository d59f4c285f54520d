#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/config.h"
#include "rl/train.h"

namespace upswing {

/// One set of settings that is trained with many seeds.
struct Variant {
  std::string name;  // its subfolder; empty: the folder of all runs
  Config config;     // its seed is ignored
};

/// Many trainings: each variant with each seed, in FOLDER/VARIANT/seedN.
struct ManyRuns {
  std::string what;  // such as `d3qn` or a study's title
  std::filesystem::path folder;
  std::pair<std::string, std::string> mark;  // name and text of the file that says what FOLDER is
  std::vector<Variant> variants;
  std::vector<int64_t> seeds;
  int64_t jobs = 1;         // runs at a time
  bool more_steps = false;  // runs with fewer steps may be resumed
  bool compared = false;    // a comparison follows when all are done

  /// Where a run lies in the folder.
  static std::filesystem::path NameOf(const Variant& variant, int64_t seed);
};

/// One of them.
struct SeedRun {
  const Variant* variant;
  int64_t seed;
  std::string name;  // such as `seed3` or `dqn/seed3`
  std::filesystem::path path;
  std::optional<TrainState> state;  // of its checkpoint, without the agent's; nothing: no run yet
  std::string problem;              // why it failed; empty if it did not

  std::filesystem::path log() const { return path.string() + ".log"; }
  bool finished() const;
  /// Steps made, of its checkpoint or, where that is further, of its metrics.
  int64_t Steps() const;
  /// Reads `state` again from the checkpoint. Throws BadInput.
  void ReadState();
};

/// Trains all that is not finished, the first seed of each variant first, each run as a process of
/// its own; shows progress and results. A folder of the same runs is resumed; finished runs are
/// left as they are. Returns the exit code: 0, or 128 and a stop signal. Throws BadInput before
/// anything is touched if the folder holds something else or runs of other settings; Failure at the
/// end if a run failed.
int TrainMany(const ManyRuns& plan);

/// How many runs at a time are best, if each has so many threads.
int DefaultJobs(int64_t threads);

}  // namespace upswing
