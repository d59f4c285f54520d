#include "apps/compare_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "apps/config.h"
#include "apps/model_info.h"
#include "apps/progress.h"
#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr const char* kModel = "model";  // its content, as the name of a setting
constexpr size_t kLongText = 48;         // longer ones are not shown

/// Name (`section.key`) and value of a setting.
using Setting = std::pair<std::string, std::string>;

/// A run with its settings.
struct FoundRun {
  RunRecord run;
  std::string agent, variant;     // its named agent; its folder's name within a study, or empty
  std::vector<Setting> settings;  // that make it another run, without the seed
  bool named = false;             // asked for itself, not found in a folder
};

/// The content of the model that it was trained and judged on; kBuiltIn for the built-in one.
const std::string& ModelOf(const FoundRun& f) { return f.settings.back().second; }

/// What its group is called.
std::string LabelOf(const FoundRun& f) {
  return Concat(f.variant.empty() ? f.agent : f.variant,
                ModelOf(f) == kBuiltIn ? "" : ", other model");
}

bool IsRun(const fs::path& folder) {
  return fs::exists(folder / "config.toml") &&
         (fs::exists(folder / "evals.csv") || fs::exists(folder / "checkpoint.safetensors"));
}

/// The run folders in a folder, at any depth, in alphabetical order.
std::vector<fs::path> RunsIn(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    throw BadInput(Concat(folder.string(), ": expected a run folder or one that holds some, got ",
                          fs::exists(folder) ? "a file" : "nothing of that name"));
  }
  if (IsRun(folder)) return {folder};
  std::vector<fs::path> found;
  for (auto entry = fs::recursive_directory_iterator(folder); entry != end(entry); ++entry) {
    if (!entry->is_directory() || !IsRun(entry->path())) continue;
    found.push_back(entry->path());
    entry.disable_recursion_pending();
  }
  std::ranges::sort(found);
  if (found.empty()) {
    throw BadInput(Concat(folder.string(), ": expected a run folder (config.toml beside evals.csv ",
                          "or checkpoint.safetensors) or one that holds some, got none"));
  }
  return found;
}

std::vector<Setting> SettingsOf(Config config) {
  std::vector<Setting> settings;
  config.model.clear();  // a model is what is in its file, not where that lies: see below
  for (const Option& option : TrainingSettings(config)) {
    const auto* text = std::get_if<std::string*>(&option.target);
    settings.emplace_back(Concat(option.section, ".", option.name),
                          text != nullptr ? **text : option.text());
  }
  settings.emplace_back(kModel, ModelContent(config.mjcf));  // the last one, for ModelOf
  return settings;
}

/// Whether a setting says what a policy is judged on, or when, and not how it is trained: those
/// that the evaluations of `train` share with its episodes, and their own.
bool IsJudged(const std::string& name) {
  constexpr std::array<std::string_view, 5> kBeginnings{"plant.", "disturbance.", "randomize.",
                                                        "train.eval_", "task.eval_"};
  return name == kModel || std::ranges::any_of(kBeginnings, [&](std::string_view beginning) {
           return name.starts_with(beginning);
         });
}

FoundRun ReadRun(const fs::path& path, const fs::path& root, bool unfinished) {
  const Config config = ReadRunConfig(path);
  const TrainConfig& t = config.train;
  FoundRun found{{path, {t.seed, t.steps, t.envs, t.eval_every, t.stop_when_solved}, {}},
                 config.agent,
                 "",
                 SettingsOf(config)};
  found.run.evaluations = ReadEvaluations(path, unfinished);
  // STUDY/VARIANT/seed1: the variant has a name of its own.
  const fs::path below = path.lexically_relative(root);
  if (std::distance(below.begin(), below.end()) > 1) {
    found.variant = path.parent_path().filename().string();
  }
  return found;
}

/// Takes out trainings that were found before, and notes it; throws at one that was named itself.
void LeaveOutTwins(std::vector<FoundRun>& runs, std::vector<std::string>& notes) {
  std::map<std::pair<int64_t, std::vector<Setting>>, fs::path> seen;
  std::erase_if(runs, [&](const FoundRun& f) {
    const auto [before, is_new] = seen.try_emplace({f.run.plan.seed, f.settings}, f.run.path);
    if (is_new) return false;
    const std::string what =
        Concat(f.run.path.string(), ": the same training as ", before->second.string(),
               " (all settings and seed ", f.run.plan.seed, ")");
    if (f.named) throw BadInput(Concat(what, "; expected each run once"));
    notes.push_back(what + ": left out");
    return true;
  });
}

/// Refuses runs that are judged on different tasks.
void CheckTogether(const std::vector<FoundRun>& runs, bool different_tasks) {
  for (const FoundRun& f : runs) {
    for (size_t i = 0; i < f.settings.size() && !different_tasks; ++i) {
      const auto& [name, value] = f.settings[i];
      const std::string& first = runs.front().settings[i].second;
      if (!IsJudged(name) || value == first) continue;
      const bool is_short = std::max(value.size(), first.size()) < kLongText;
      throw BadInput(Concat(f.run.path.string(), ": judged on another task than ",
                            runs.front().run.path.string(), ": ", name,
                            is_short ? Concat(" = ", value, " instead of ", first) : " differs",
                            "; expected one task (--different-tasks compares them all the same)"));
    }
  }
}

/// Takes out what cannot be compared: runs without an evaluation. Throws at unfinished ones, unless
/// they are asked for; then they are noted.
void CheckFinished(std::vector<FoundRun>& runs, bool unfinished, std::vector<std::string>& notes) {
  for (const FoundRun& f : runs) {
    const RunRecord& run = f.run;
    if (Finished(run)) continue;
    const std::string path = run.path.string();
    const int64_t step = run.evaluations.empty() ? 0 : run.evaluations.back().step;
    const std::string how_far = step == 0
                                    ? "has no evaluation yet"
                                    : fmt::format("is unfinished, evaluated up to step {} of {}",
                                                  FormatCount(step), FormatCount(run.plan.steps));
    if (!unfinished) {
      throw BadInput(Concat(path, ": ", how_far, "; expected a run that has finished (train ",
                            "--resume goes on with it, --unfinished takes it as it is)"));
    }
    notes.push_back(Concat(path, " ", how_far, step == 0 ? ": left out" : ""));
  }
  std::erase_if(runs, [](const FoundRun& f) { return f.run.evaluations.empty(); });
  if (runs.empty()) throw BadInput("expected a run with an evaluation, got none");
}

/// The settings of a run in which not all of `others` agree with it, such as `hidden [64, 64], head
/// 32`.
std::string Differences(const FoundRun& of, const std::vector<const FoundRun*>& others) {
  std::vector<std::string> parts;
  for (size_t i = 0; i < of.settings.size(); ++i) {
    const std::string& name = of.settings[i].first;
    const std::string& value = of.settings[i].second;  // clang 14 captures no structured binding
    const bool differs = std::ranges::any_of(
        others, [&](const FoundRun* other) { return other->settings[i].second != value; });
    if (!differs || name == "train.agent") continue;
    const std::string key = name.substr(name.find('.') + 1);
    parts.push_back(value.size() < kLongText ? Concat(key, " ", value) : key);
  }
  return Join(parts, ", ");
}

/// Says of each group (`first` has a run of each) how it differs from the others, and gives those
/// of one name a second one: their differences among each other, or a number where these are many.
void TellGroupsApart(GroupedRuns& grouped, const std::vector<const FoundRun*>& first) {
  std::map<std::string, std::vector<const FoundRun*>> namesakes;
  for (size_t i = 0; i < first.size(); ++i) {
    grouped.differences.push_back(Differences(*first[i], first));
    namesakes[grouped.groups[i].label].push_back(first[i]);
  }
  std::map<std::string, int> count;
  for (size_t i = 0; i < first.size(); ++i) {
    std::string& label = grouped.groups[i].label;
    const auto& same_name = namesakes[label];
    if (same_name.size() == 1) continue;
    const int number = ++count[label];
    const std::string differences = Differences(*first[i], same_name);
    label += differences.empty() || differences.size() > kLongText ? Concat(" #", number)
                                                                   : Concat(" (", differences, ")");
  }
}

/// What a reader of the figures should know.
void NotePlans(const GroupedRuns& grouped, std::vector<std::string>& notes) {
  std::set<std::pair<int64_t, bool>> of_all;
  for (const RunGroup& group : grouped.groups) {
    std::set<int64_t> budgets;
    std::set<bool> stops;
    for (const RunRecord& run : group.runs) {
      budgets.insert(run.plan.steps);
      stops.insert(run.plan.stop_when_solved);
      of_all.emplace(run.plan.steps, run.plan.stop_when_solved);
    }
    if (budgets.size() > 1) {
      notes.push_back(fmt::format("{}: the runs have different budgets, {} to {} steps",
                                  group.label, FormatCount(*budgets.begin()),
                                  FormatCount(*budgets.rbegin())));
    }
    if (stops.size() > 1) {
      notes.push_back(group.label + ": some runs stop when solved and some go on");
    }
    if (group.runs.size() == 1) {
      notes.push_back(group.label + ": no intervals, there is one seed only");
    } else if (group.runs.size() < 5) {
      notes.push_back(fmt::format("{}: {} seeds are few, intervals are too narrow", group.label,
                                  group.runs.size()));
    }
  }
  if (notes.empty() && of_all.size() > 1) {
    notes.emplace_back("the groups differ in their budgets of steps or in stopping when solved");
  }
}

}  // namespace

GroupedRuns GroupRuns(const CompareRequest& request) {
  std::vector<FoundRun> runs;
  std::set<fs::path> seen;
  for (const fs::path& argument : request.paths) {
    for (const fs::path& path : RunsIn(argument)) {
      if (!seen.insert(fs::weakly_canonical(path)).second) {
        throw BadInput(Concat(path.string(), ": given twice; expected each run once"));
      }
      const fs::path& root = request.root.empty() ? argument : request.root;
      runs.push_back(ReadRun(path, root, request.unfinished));
      runs.back().named = path == argument;
    }
  }
  GroupedRuns grouped;
  LeaveOutTwins(runs, grouped.notes);
  CheckTogether(runs, request.different_tasks);
  CheckFinished(runs, request.unfinished, grouped.notes);

  std::vector<const FoundRun*> first;  // of each group
  for (const FoundRun& f : runs) {
    const auto same = [&](const FoundRun* other) { return other->settings == f.settings; };
    const auto at = static_cast<size_t>(std::ranges::find_if(first, same) - first.begin());
    if (at == first.size()) {
      first.push_back(&f);
      grouped.groups.push_back({LabelOf(f), {}});
    }
    grouped.groups[at].runs.push_back(f.run);
  }
  for (RunGroup& group : grouped.groups) {
    std::ranges::sort(group.runs, {}, [](const RunRecord& run) { return run.plan.seed; });
  }
  TellGroupsApart(grouped, first);
  NotePlans(grouped, grouped.notes);
  for (size_t i = 0; i < first.size(); ++i) {
    if (ModelOf(*first[i]) == kBuiltIn) continue;
    grouped.notes.push_back(Concat(grouped.groups[i].label, ": on a model that is not the ",
                                   "built-in one (content ", ModelOf(*first[i]), ")"));
  }
  return grouped;
}

}  // namespace upswing
