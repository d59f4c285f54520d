#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lab/config.h"
#include "lab/training_run.h"

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

/// Who is told how many runs go on, and asked whether to stop.
class ManyRunsObserver {
 public:
  virtual ~ManyRunsObserver() = default;

  /// All is checked and nothing touched; what is begun from here on should end in order.
  virtual void Prepare() {}
  /// These runs follow, and outlive the observer's last call.
  virtual void Begin(const std::vector<SeedRun>& runs) = 0;
  /// Called again and again, with those that run now.
  virtual void Watch(const std::vector<const SeedRun*>& running) = 0;
  /// A run has ended in any way.
  virtual void End(const SeedRun& run) = 0;
  /// All have ended, or were stopped.
  virtual void Finish() = 0;
  /// Whether the runs should write a checkpoint or stop; asked again and again.
  virtual TrainRequest Poll() = 0;
  /// The signal with which to stop them, such as SIGTERM; 0 as long as there is none.
  virtual int stop_signal() const = 0;
};

/// Trains all that is not finished, the first seed of each variant first, each run as a process of
/// its own (this program's `train`). A folder of the same runs is resumed; finished runs are
/// left as they are. Returns the exit code: 0, or 128 and a stop signal. Throws BadInput before
/// anything is touched if the folder holds something else or runs of other settings; Failure at the
/// end if a run failed.
int TrainMany(const ManyRuns& plan, ManyRunsObserver& observer);

/// How many runs at a time are best, if each has so many threads.
int DefaultJobs(int64_t threads);

}  // namespace upswing
