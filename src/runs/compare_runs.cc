#include "runs/compare_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "agents/controllers.h"
#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "os/file.h"
#include "os/making.h"
#include "runs/config_files.h"
#include "runs/find_policy.h"
#include "runs/finished_run.h"
#include "runs/run_folder.h"
#include "runs/study_plan.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

bool IsRun(const fs::path& folder) {
  const auto has = [&](const char* name) { return Exists(folder / name); };
  return has(RunFolder::kConfig) && (has(RunFolder::kEvaluations) || has(RunFolder::kCheckpoint));
}

/// The result file that a study writes next to a finished run's folder.
fs::path DoneOf(const fs::path& run) { return run.string() + ".done"; }

/// The seed in the name of a study's run; nothing if the name has none.
std::optional<int64_t> SeedOf(const fs::path& path) {
  constexpr std::string_view kSeed = "seed";
  const std::string name = path.filename().string();
  if (!name.starts_with(kSeed)) return std::nullopt;
  return ParseInteger(std::string_view(name).substr(kSeed.size()));
}

/// Whether a path is a run, or a study's run of which only the result file is left.
bool IsKept(const fs::path& run) { return IsRun(run) || IsOwnFile(DoneOf(run)); }

/// Adds the run folders in a folder, at any depth; links are not followed.
void AddRuns(const fs::path& folder, Found& found, std::vector<fs::path>& paths) {
  if (IsRun(folder)) {
    paths.push_back(folder);
    return;
  }
  std::error_code error;
  fs::directory_iterator entries(folder, error);
  if (error) return found.LeaveOut(folder, Concat("cannot be read: ", error.message()));
  for (const fs::directory_entry& entry : entries) {
    if (IsMakingName(entry.path().filename().string())) continue;  // left by a killed process
    if (entry.path().extension() == ".done") {
      const fs::path run = fs::path(entry.path()).replace_extension();
      if (SeedOf(run) && !IsRun(run) && IsKept(run)) paths.push_back(run);
      continue;
    }
    const bool is_folder = fs::is_directory(entry.symlink_status(error));
    const bool is_run = fs::is_directory(entry.path(), error) && IsRun(entry.path());
    if (is_folder || is_run) AddRuns(entry.path(), found, paths);
  }
}

/// Throws BadInput if a path is the name or the file of a policy or controller.
void ExpectNoPolicy(const fs::path& path) {
  const bool is_name = IsController(path.string()) && !Exists(path);
  const bool is_file = path.extension() == ".safetensors" && IsFile(path);
  if (!is_name && !is_file && ShippedPolicy(path).empty()) return;
  throw BadInput(Concat(path.string(), ": expected a run or a folder of runs, got a policy or ",
                        "controller, which `upswing eval ", path.string(), "` judges"));
}

/// The run folders in a folder, in alphabetical order.
std::vector<fs::path> RunsIn(const fs::path& folder, Found& found) {
  if (IsKept(folder)) return {folder};
  ExpectNoPolicy(folder);
  if (!Exists(folder)) {
    throw BadInput(
        Concat(folder.string(), ": no such file or folder; expected a run or a folder of runs"));
  }
  std::vector<fs::path> paths;
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    found.LeaveOut(folder, "expected a run folder, got another file");
    return paths;
  }
  const size_t problems = found.left_out.size();
  AddRuns(folder, found, paths);
  std::ranges::sort(paths);
  if (paths.empty() && found.left_out.size() == problems) {
    found.LeaveOut(folder,
                   "expected a run folder (config.toml next to evals.csv or "
                   "checkpoint.safetensors) or a folder of runs, got neither");
  }
  return paths;
}

/// Reads runs. Prefers the result file of a study's finished run.
class RunReader {
 public:
  RunReader(const CompareRequest& request, Found& found) : request_(request), found_(found) {}

  /// Adds a run among those in the folder `argument`. Throws BadInput.
  void Read(const fs::path& path, const fs::path& argument) {
    const bool is_run = IsRun(path);
    std::optional<RunRecord> run;
    try {
      run = ReadDone(path);
    } catch (const Error&) {
      if (!is_run) throw;  // the run folder holds the same facts
    }
    if (!run && !is_run) {
      throw BadInput(Concat(DoneOf(path).string(), ": expected the settings of ",
                            (path.parent_path() / kSettingsName).string(), ", got others"));
    }
    if (!run) {
      run = RunRecord{path, ReadRunConfig(path), ""};
      run->settings = SettingsMark(run->config);
      run->conditions = RunConditions::Of(path);
      run->evaluations = ReadEvaluations(path, request_.unfinished);
    }
    // A study's layout is STUDY/VARIANT/seed1; the variant's folder names the variant.
    const fs::path below =
        path.lexically_relative(request_.root.empty() ? argument : request_.root);
    if (std::distance(below.begin(), below.end()) > 1) {
      run->variant = path.parent_path().filename().string();
    }
    found_.runs.push_back(std::move(*run));
  }

 private:
  /// Reads a run's result file; nothing if there is none, or if the run has continued since.
  std::optional<RunRecord> ReadDone(const fs::path& path) {
    const auto seed = SeedOf(path);
    if (!seed) return std::nullopt;
    const auto done = FinishedRun::Read(DoneOf(path));
    if (!done) return std::nullopt;
    std::error_code error;
    const fs::path table = path / RunFolder::kEvaluations;
    if (fs::exists(table, error) && fs::file_size(table, error) != done->evaluations.size()) {
      return std::nullopt;
    }
    RunRecord run = VariantIn(path.parent_path());
    if (run.settings != done->settings) return std::nullopt;
    run.path = path;
    run.config.train.seed = *seed;
    run.config.train.steps = done->planned_steps;
    run.config.train.stop_when_solved = done->stop_when_solved;
    run.conditions = done->conditions;
    run.evaluations = ParseEvaluations(done->evaluations, DoneOf(path).string(), false);
    return run;
  }

  /// The settings that all seeds of a variant share.
  const RunRecord& VariantIn(const fs::path& folder) {
    const auto at = variants_.find(folder);
    if (at != variants_.end()) return at->second;
    RunRecord run{folder, ReadSettings(folder / kSettingsName), ""};
    MakeReadyForMany(run.config);
    run.settings = SettingsMark(run.config);
    return variants_.emplace(folder, std::move(run)).first->second;
  }

  const CompareRequest& request_;
  Found& found_;
  std::map<fs::path, RunRecord> variants_;
};

/// Reads all runs; leaves out runs that cannot be read.
Found ReadRuns(const CompareRequest& request) {
  Found found;
  RunReader reader(request, found);
  std::set<fs::path> seen;
  for (const std::string& argument : request.paths) {
    for (const fs::path& path : RunsIn(argument, found)) {
      if (!seen.insert(fs::weakly_canonical(path)).second) {
        throw BadInput(Concat(path.string(), ": expected each run once, got it twice"));
      }
      try {
        reader.Read(path, argument);
      } catch (const Error& error) {
        // Most messages already begin with the file.
        const std::string what = error.what();
        if (what.starts_with(path.string())) {
          found.left_out.push_back(what);
        } else {
          found.LeaveOut(path, what);
        }
      }
    }
  }
  return found;
}

/// Training steps up to the last evaluation.
int64_t LastStep(const RunRecord& run) {
  return run.evaluations.empty() ? 0 : run.evaluations.back().step;
}

/// Keeps, of runs of the same training, the longest; if several are equal, the first.
void DropDuplicates(Found& found) {
  const auto key = [](const RunRecord& run) {
    return std::pair(run.config.train.seed, run.settings);
  };
  struct Longest {
    int64_t steps = -1;
    fs::path path;
  };
  std::map<std::pair<int64_t, std::string>, Longest> longest;  // by seed and settings
  for (const RunRecord& run : found.runs) {
    Longest& kept = longest[key(run)];
    if (LastStep(run) > kept.steps) kept = {LastStep(run), run.path};
  }
  std::erase_if(found.runs, [&](const RunRecord& run) {
    const fs::path& kept = longest.at(key(run)).path;
    if (run.path == kept) return false;
    found.LeaveOut(run.path, Concat("the same training as ", kept.string(),
                                    " (all settings and seed ", run.config.train.seed, ")"));
    return true;
  });
}

/// Removes runs without an evaluation. Also removes unfinished runs, unless they are requested;
/// then it adds a note.
void LeaveOutUnfinished(Found& found, bool unfinished) {
  std::erase_if(found.runs, [&](const RunRecord& run) {
    if (Finished(run)) return false;
    if (run.evaluations.empty()) {
      found.LeaveOut(run.path, "has no evaluation yet");
      return true;
    }
    const std::string how_far =
        fmt::format("is unfinished, evaluated up to step {} of {}",
                    FormatCount(run.evaluations.back().step), FormatCount(run.config.train.steps));
    if (unfinished) {
      found.notes.push_back(Concat(run.path.string(), ": ", how_far));
    } else {
      found.LeaveOut(run.path, Concat(how_far, " (train --resume continues it, --unfinished ",
                                      "compares it as it is)"));
    }
    return !unfinished;
  });
}

}  // namespace

void Found::LeaveOut(const fs::path& path, std::string_view why) {
  left_out.push_back(Concat(path.string(), ": ", why));
}

Found FindRuns(const CompareRequest& request) {
  Found found = ReadRuns(request);
  DropDuplicates(found);
  LeaveOutUnfinished(found, request.unfinished);
  return found;
}

}  // namespace upswing
