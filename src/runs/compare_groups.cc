#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"
#include "runs/compare_runs.h"

namespace upswing {
namespace {

constexpr size_t kLongText = 48;  // longer differences are not shown

/// The label of a run's group.
std::string LabelOf(const RunRecord& run) {
  return run.variant.empty() ? run.config.agent : run.variant;
}

/// Whether a setting belongs to the task that a policy is evaluated on: plant, disturbance,
/// randomisation, goals, and how many episodes have to succeed. Settings of the training, and of
/// when and in which engine it evaluates, do not belong to it.
bool IsTask(const Option& option) {
  constexpr std::array<std::string_view, 3> kSections{"plant", "disturbance", "randomize"};
  return option.name == "eval_episodes" || option.name == "environment" ||
         option.name == "any_pose" ||
         std::ranges::find(kSections, option.section) != kSections.end();
}

/// Tells whether a setting counts.
using Wanted = bool (*)(const Option& option);

/// The settings that decide the training and differ from some of `others`, such as `hidden [64,
/// 64], head 32`.
std::string Differences(
    const Options& settings, const std::vector<const Options*>& others,
    Wanted wanted = [](const Option& option) { return option.name != "agent"; }) {
  std::vector<std::string> parts;
  for (const Option& option : settings.all()) {
    if (option.decides != Option::Decides::kTraining || !wanted(option)) continue;
    const bool differs = std::ranges::any_of(others, [&](const Options* other) {
      const Option* its = other->Get(option.name);
      return its == nullptr || its->text() != option.text();
    });
    if (!differs) continue;
    const auto* text = std::get_if<std::string*>(&option.target);
    const std::string value = text != nullptr ? **text : option.text();
    parts.push_back(value.size() < kLongText ? Concat(option.name, " ", value) : option.name);
  }
  return Join(parts, ", ");
}

/// The folder of the only run of a group, or the one that holds all of them; empty if they are in
/// several.
std::string FolderOf(const RunGroup& group) {
  const auto& runs = group.runs;
  if (runs.size() == 1) return runs.front().path.string();
  const auto parent = runs.front().path.parent_path();
  const auto inside = [&](const RunRecord& run) { return run.path.parent_path() == parent; };
  return std::ranges::all_of(runs, inside) ? parent.string() : "";
}

/// Sets how each group (with these `settings`) differs from the others. Groups with the same name
/// get a second name: their differences from each other; if those are long, their folder; if
/// another one has the same folder, a number.
void TellGroupsApart(std::vector<RunGroup>& groups, const std::vector<Options>& settings) {
  std::vector<const Options*> all;
  std::map<std::string, std::vector<const Options*>> namesakes;
  for (size_t i = 0; i < groups.size(); ++i) {
    all.push_back(&settings[i]);
    namesakes[groups[i].label].push_back(&settings[i]);
  }
  std::map<std::string, int> count, in_folder;
  for (const RunGroup& group : groups) ++in_folder[FolderOf(group)];
  for (size_t i = 0; i < groups.size(); ++i) {
    std::string& label = groups[i].label;
    groups[i].differences = Differences(settings[i], all);
    const auto& same_name = namesakes[label];
    if (same_name.size() == 1) continue;
    const int number = ++count[label];
    const std::string differences = Differences(settings[i], same_name);
    const std::string folder = FolderOf(groups[i]);
    if (!differences.empty() && differences.size() <= kLongText) {
      label += Concat(" (", differences, ")");
    } else if (!folder.empty() && in_folder[folder] == 1) {
      label += Concat(" in ", folder);
    } else {
      label += Concat(" #", number);
    }
  }
}

/// Adds notes on the groups' numbers of seeds and on budgets that readers of the figures should
/// know.
void NotePlans(const std::vector<RunGroup>& groups, std::vector<std::string>& notes) {
  std::set<std::pair<int64_t, bool>> of_all;
  std::map<size_t, std::vector<std::string>> few;  // labels by their number of seeds
  for (const RunGroup& group : groups) {
    std::set<int64_t> budgets;
    std::set<bool> stops;
    for (const RunRecord& run : group.runs) {
      const TrainConfig& train = run.config.train;
      budgets.insert(train.steps);
      stops.insert(train.stop_when_solved);
      of_all.emplace(train.steps, train.stop_when_solved);
    }
    if (budgets.size() > 1) {
      notes.push_back(fmt::format("{}: the runs have different budgets, {} to {} steps",
                                  group.label, FormatCount(*budgets.begin()),
                                  FormatCount(*budgets.rbegin())));
    }
    if (stops.size() > 1) {
      notes.push_back(group.label + ": some runs stop when solved and some do not");
    }
    if (group.runs.size() == 1) {
      notes.push_back(group.label + ": no intervals, because there is only one seed");
    } else if (group.runs.size() < 5) {
      few[group.runs.size()].push_back(group.label);
    }
  }
  for (const auto& [seeds, labels] : few) {
    notes.push_back(fmt::format("{}: intervals are too narrow, because {} seeds are few",
                                Join(labels, ", "), seeds));
  }
  if (notes.empty() && of_all.size() > 1) {
    notes.emplace_back("the groups differ in steps or stop_when_solved");
  }
}

/// Adds a note if comparable runs had different shares of their processors.
void NoteLoads(const std::vector<RunRecord>& runs, std::vector<std::string>& notes) {
  std::map<std::pair<std::string, std::set<int64_t>>, std::vector<double>> busy;
  for (const RunRecord& run : runs) {
    const RunConditions& c = run.conditions;
    if (c.busy) busy[{run.settings, c.threads}].push_back(*c.busy);
  }
  for (const auto& [same_work, shares] : busy) {
    constexpr double kAlike = 0.75;
    const auto [low, high] = std::ranges::minmax(shares);
    if (low >= kAlike * high) continue;
    notes.push_back(fmt::format(
        "times were measured under different machine loads: of runs with the same settings and "
        "threads, one had its threads at work {:.0f}% of the time, another {:.0f}%",
        100 * low, 100 * high));
    return;
  }
}

/// Adds notes on conditions that change the times and differ between runs, other than settings.
void NoteTimes(const std::vector<RunRecord>& runs, std::vector<std::string>& notes) {
  std::set<std::string> processors, vectors;
  std::set<int64_t> threads, intervals;
  for (const RunRecord& run : runs) {
    const RunConditions& c = run.conditions;
    intervals.insert(run.config.train.eval_every);
    threads.insert(c.threads.begin(), c.threads.end());
    for (const std::string& name : c.processors) processors.insert(Printable(name));
    for (const std::string& name : c.vectors) vectors.insert(Printable(name));
  }
  const auto note = [&](std::string_view what, const auto& values) {
    if (values.size() < 2) return;
    notes.push_back(fmt::format("times were measured {}: {}", what, fmt::join(values, "; ")));
  };
  note("with different numbers of threads", threads);
  note("on different processors", processors);
  note("with different vector instructions", vectors);
  NoteLoads(runs, notes);
  if (intervals.size() > 1) {
    notes.push_back(fmt::format(
        "runs are evaluated every {} to {} steps: the resolution of times and steps to solve",
        FormatCount(*intervals.begin()), FormatCount(*intervals.rbegin())));
  }
}

/// Numbers the tasks that the groups (with these `settings`) are evaluated on, in their order.
void TellTasksApart(Comparison& comparison, const std::vector<Options>& settings) {
  std::vector<const Options*> tasks;  // of a group on each task
  for (size_t i = 0; i < settings.size(); ++i) {
    const auto same = [&](const Options* other) {
      return Differences(settings[i], {other}, IsTask).empty();
    };
    const auto at = std::ranges::find_if(tasks, same);
    comparison.groups[i].task = static_cast<int>(at - tasks.begin());
    if (at == tasks.end()) tasks.push_back(&settings[i]);
  }
  for (const Options* task : tasks) {
    comparison.task_texts.push_back(Differences(*task, tasks, IsTask));
  }
}

void NoteTasks(Comparison& comparison, bool different_tasks) {
  const size_t tasks = comparison.task_texts.size();
  if (tasks == 1) return;
  comparison.notes.push_back(fmt::format(
      "the groups are evaluated on {} different tasks: {}", tasks,
      different_tasks ? "the table holds figures of different tasks"
                      : "groups are compared within a task (--different-tasks compares all)"));
}

}  // namespace

Comparison GroupRuns(const CompareRequest& request) {
  const Found found = FindRuns(request);
  if (found.runs.empty()) {
    const size_t others = found.left_out.size() - 1;
    throw BadInput(Concat(
        found.left_out.front(),
        others > 0 ? Concat("; no run is left to compare (", others, " more were left out)") : ""));
  }
  Comparison comparison;
  std::vector<RunGroup>& groups = comparison.groups;
  for (const RunRecord& run : found.runs) {
    const auto same = [&](const RunGroup& group) {
      return group.runs.front().settings == run.settings;
    };
    auto at = std::ranges::find_if(groups, same);
    if (at == groups.end()) at = groups.insert(at, {LabelOf(run), {}});
    at->runs.push_back(run);
  }
  for (RunGroup& group : groups) {
    std::ranges::sort(group.runs, {}, [](const RunRecord& run) { return run.config.train.seed; });
  }
  // One order, in which pairs are compared, whatever the order of the runs on the command line.
  std::ranges::sort(groups, {}, [](const RunGroup& group) {
    return std::pair(group.label, group.runs.front().path);
  });
  std::vector<Options> settings;
  for (RunGroup& group : groups) {
    Config& config = group.runs.front().config;
    config.randomization.DropUnused();
    settings.push_back(OptionsOf(config));
  }
  TellGroupsApart(groups, settings);
  TellTasksApart(comparison, settings);
  std::ranges::stable_sort(groups, {}, &RunGroup::task);
  comparison.notes = found.notes;
  NotePlans(groups, comparison.notes);
  NoteTimes(found.runs, comparison.notes);
  NoteTasks(comparison, request.different_tasks);
  for (const std::string& line : found.left_out) comparison.notes.push_back(line + ": left out");
  if (request.different_tasks) {
    for (RunGroup& group : groups) group.task = 0;
    comparison.task_texts.resize(1);
  }
  return comparison;
}

}  // namespace upswing
