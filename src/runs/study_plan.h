#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "agents/config.h"
#include "runs/finished_run.h"

namespace upswing {

/// A set of settings that is trained with many seeds.
struct Variant {
  std::string name;  // name of its subfolder; empty: the runs are directly in the study's folder
  Config config;     // its seed is ignored
};

/// Files of a finished run that are kept.
enum class Keep {
  kAll,
  kPolicy,  // best policy, settings, evaluations and log
  kTables,  // rows in the study's tables
};
/// Parses "all", "policy" or "tables". Throws BadInput that begins with `where`.
Keep ParseKeep(std::string_view text, const std::string& where);

/// Largest number of variants of a study.
inline constexpr size_t kMostVariants = 10'000;

/// Many trainings: each variant with each seed, in FOLDER/VARIANT/seedN.
struct StudyPlan {
  std::filesystem::path folder;
  std::string title;  // may be empty
  std::vector<Variant> variants;
  std::vector<int64_t> seeds;
  Keep keep = Keep::kAll;
};

/// Parses the text of a study file: a plan without a folder; without seeds if the file has none.
/// `keep` counts if the file has no such line. `where` is the path of the file. Throws BadInput
/// with the line.
StudyPlan ParseStudy(std::string_view text, const std::string& where, Keep keep = Keep::kAll);

/// A run of a plan. Its state is in files next to its folder. Any process on any host with access
/// to the folder can therefore continue it.
struct SeedRun {
  const Variant* variant;
  std::string settings;  // SettingsMark of the variant
  int64_t seed;
  std::string name;                 // such as `seed3` or `dqn/seed3`
  std::filesystem::path path;       // path of its folder
  std::optional<TrainState> state;  // current state; nothing: not begun
  std::string problem;              // reason of the failure; empty: not failed
  bool finished = false;            // whether the file done() says that it is finished

  std::filesystem::path log() const { return With(".log"); }        // output of the run
  std::filesystem::path claim() const { return With(".claim"); }    // FileLock of its worker
  std::filesystem::path done() const { return With(".done"); }      // its result
  std::filesystem::path failed() const { return With(".failed"); }  // failure reason, one line
  /// Whether its state is at the end. done() may not say so yet.
  bool AtEnd() const { return state && state->Finished(variant->config.train); }
  /// Whether the file failed() exists.
  bool HasFailed() const;
  /// Whether it is done, but its files no longer suffice to resume it.
  bool IsReduced() const;
  /// Steps made, from the checkpoint or the metrics, whichever is further.
  int64_t Steps() const;
  /// Reads state and problem. Throws BadInput.
  void Read();
  /// Reads state and problem. An error becomes the run's problem.
  void Refresh();
  /// Writes the reason of its failure to the file failed().
  void WriteFailed(const std::string& why) const;

 private:
  std::filesystem::path With(const char* ending) const { return path.string() + ending; }
};

/// All runs of a plan, the first seed of each variant first. The plan must outlive them. Reads no
/// files.
std::vector<SeedRun> RunsOf(const StudyPlan& plan);

/// Writes plan.json into the plan's folder, and the settings of each variant into
/// VARIANT/settings.toml.
void WritePlan(const StudyPlan& plan);

/// The plan in plan.json, without its folder and its variants' settings. Adds the SettingsMark of
/// each variant to `marks`. Throws BadInput.
StudyPlan PlanIn(const nlohmann::json& plan, std::vector<std::string>& marks);

/// Reads the plan in a folder. Throws BadInput if there is none, if it is from another version, or
/// if a variant's settings no longer match the plan.
StudyPlan ReadPlan(const std::filesystem::path& folder);

/// The plan in a folder as PlanIn reads it; nothing if there is no readable one.
std::optional<StudyPlan> PlanBefore(const std::filesystem::path& folder);

/// Writes evaluations.csv into the folder of a plan: the rows of evals.csv of all finished runs,
/// with variant and seed.
void WriteEvaluations(const StudyPlan& plan);

/// Names of the files.
inline constexpr const char* kPlanName = "plan.json";
inline constexpr const char* kSettingsName = "settings.toml";  // one per variant, without seed

/// Throws BadInput that begins with `place` unless `name` is valid for a variant and its folder:
/// letters, digits, - and _.
void CheckVariantName(const std::string& name, const std::string& place);

}  // namespace upswing
