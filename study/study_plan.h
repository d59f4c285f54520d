#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "run/finished_run.h"
#include "setup/config.h"

namespace upswing {

/// One set of settings that is trained with many seeds.
struct Variant {
  std::string name;  // its subfolder; empty: the folder of all runs
  Config config;     // its seed is ignored
};

/// What is kept of a finished run.
enum class Keep {
  kAll,
  kPolicy,  // its best policy, settings, evaluations and log
  kTables,  // its rows of the study's tables
};
/// The value that "all", "policy" or "tables" names. Throws BadInput that begins with `where`.
Keep ParseKeep(std::string_view text, const std::string& where);

/// Many trainings: each variant with each seed, in FOLDER/VARIANT/seedN.
struct StudyPlan {
  std::filesystem::path folder;
  std::vector<Variant> variants;
  std::vector<int64_t> seeds;
  Keep keep = Keep::kAll;
};

/// One of them. What is known of it stands in files beside its folder, so that any process of any
/// host that has the folder can go on with it.
struct SeedRun {
  const Variant* variant;
  std::string settings;  // the variant's SettingsMark
  int64_t seed;
  std::string name;                 // such as `seed3` or `dqn/seed3`
  std::filesystem::path path;       // of its folder
  std::optional<TrainState> state;  // where it stands; nothing: it has not begun
  std::string problem;              // why it failed; empty if it did not
  bool finished = false;            // it says so itself, in done()

  std::filesystem::path log() const { return With(".log"); }        // what it printed
  std::filesystem::path claim() const { return With(".claim"); }    // the Lease of who trains it
  std::filesystem::path done() const { return With(".done"); }      // its result
  std::filesystem::path failed() const { return With(".failed"); }  // why it failed, one line
  /// Whether it stands at its end, though perhaps it does not say so yet.
  bool AtEnd() const { return state && state->Finished(variant->config.train); }
  /// Whether it is said that it failed.
  bool HasFailed() const;
  /// Whether it was done, and what resuming it takes was not kept.
  bool IsReduced() const;
  /// Steps made, of its checkpoint or, where that is further, of its metrics.
  int64_t Steps() const;
  /// Reads again whether it is finished, and its state then. Throws BadInput.
  bool ReadIfFinished();
  /// Reads state and problem again. Throws BadInput.
  void Read();
  /// The same, but an error becomes the run's problem.
  void Refresh();

 private:
  std::filesystem::path With(const char* ending) const { return path.string() + ending; }
};

/// All runs of a plan, which must outlive them, the first seed of each variant first; nothing is
/// read.
std::vector<SeedRun> RunsOf(const StudyPlan& plan);

/// Writes the plan into its folder: plan.json, and the settings of each variant in
/// VARIANT/settings.toml, with the model where it is not the built-in one.
void WritePlan(const StudyPlan& plan);

/// The plan in a folder. Throws BadInput if there is none, if it is another version's, or if
/// settings are no longer those of the plan.
StudyPlan ReadPlan(const std::filesystem::path& folder);

/// What the plan in a folder keeps; everything if there is none that can be read.
Keep KeepOf(const std::filesystem::path& folder);

/// The names of the files.
inline constexpr const char* kPlanName = "plan.json";
inline constexpr const char* kSettingsName = "settings.toml";  // of a variant, without seed

/// Throws BadInput that begins with `place` unless a variant can have this name, which its folder
/// has too: letters, digits, - and _.
void CheckVariantName(const std::string& name, const std::string& place);

}  // namespace upswing
