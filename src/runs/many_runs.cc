#include "runs/many_runs.h"

#include <algorithm>
#include <iterator>
#include <optional>

#include "base/error.h"
#include "base/text.h"
#include "os/host.h"
#include "runs/config_files.h"
#include "runs/run_folder.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Throws BadInput if `what`, made with the settings `before`, cannot be resumed with the settings
/// `now`.
void CheckSame(Config before, const Config& now, bool more_steps, const std::string& what) {
  if (more_steps) before.train.steps = std::max(before.train.steps, now.train.steps);
  const auto counts = [](const Option& option) {
    return option.decides == Option::Decides::kTraining || option.decides == Option::Decides::kEnd;
  };
  try {
    ExpectSameSettings(before, now, what, counts);
  } catch (const Error& other) {
    throw BadInput(Concat(other.what(), "; choose another --out"));
  }
}

/// Throws BadInput if a run in a variant's folder, or the folder's settings file, has other
/// settings.
void CheckRuns(const fs::path& folder, const Config& config, bool more_steps) {
  std::error_code error;
  const std::string mark = SettingsMark(config);
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (IsMakingName(entry.path().filename().string())) continue;
    if (!IsFile(entry.path() / RunFolder::kConfig)) continue;
    const auto done = FinishedRun::Read(entry.path().string() + ".done");
    const bool same = done && done->settings == mark && done->version == UPSWING_VERSION &&
                      done->planned_steps == config.train.steps &&
                      done->stop_when_solved == config.train.stop_when_solved;
    if (!same) CheckSame(ReadRunConfig(entry.path()), config, more_steps, entry.path().string());
  }
  const fs::path settings = folder / kSettingsName;
  if (!IsFile(settings)) return;
  CheckSame(ReadSettings(settings), config, more_steps, settings.string());
}

}  // namespace

FolderLock Prepare(const ManyRuns& many) {
  // Touch nothing before all checks have passed, nor while another process works there.
  const StudyPlan& plan = many.plan;
  if (!IsFile(plan.folder / kPlanName)) {
    CheckFree(plan.folder,
              Concat("it has no ", kPlanName, " to resume from; choose another --out"));
  }
  std::optional<FolderLock> lock;
  if (Exists(plan.folder)) lock.emplace(plan.folder);
  for (const Variant& variant : plan.variants) {
    const fs::path folder = plan.folder / variant.name;
    if (!variant.name.empty()) CheckNoLink(folder);
    CheckRuns(folder, variant.config, many.more_steps);
  }
  NewFolder folder(plan.folder);
  if (!lock) lock.emplace(plan.folder);
  ExpectFileLocks(plan.folder);  // for the claims of the workers
  folder.Keep();
  WritePlan(plan);
  if (!many.study_file.empty()) WriteIfOther(plan.folder / "study.toml", many.study_file);
  for (const SeedRun& run : RunsOf(plan)) fs::remove(run.failed());  // so that it is tried again
  return std::move(*lock);
}

std::vector<int64_t> KeepFinishedSeeds(const StudyPlan& before, StudyPlan& plan) {
  StudyPlan others = plan;
  others.seeds.clear();
  std::ranges::copy_if(before.seeds, std::back_inserter(others.seeds), [&](int64_t seed) {
    return std::ranges::find(plan.seeds, seed) == plan.seeds.end();
  });
  for (SeedRun& run : RunsOf(others)) {
    run.Refresh();
    if (!run.finished || !run.AtEnd()) std::erase(others.seeds, run.seed);
  }
  if (others.seeds.empty()) return {};
  std::ranges::copy(others.seeds, std::back_inserter(plan.seeds));
  std::ranges::sort(plan.seeds);
  return others.seeds;
}

int DefaultJobs(int64_t threads) {
  return std::max(1, UsableProcessors() / static_cast<int>(std::max<int64_t>(1, threads)));
}

}  // namespace upswing
